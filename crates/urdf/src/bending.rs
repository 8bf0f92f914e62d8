//! `[links.L.bending]`: links that bend or twist.

use serde_spanned::Spanned;
use sinew_model::{Bending, LinkId, Model};

use crate::UrdfError;
use crate::assembly::require_link;
use crate::grammar::{BendingTable, Entries, LinkTable};
use crate::source::{Domain, Source};

/// Checks the links that bend.
pub(crate) fn bending(
    model: &Model,
    links: &Entries<LinkTable>,
    source: Source,
) -> Result<Vec<Bending>, UrdfError> {
    let mut list = Vec::new();
    for (name, table) in &links.0 {
        let link = require_link(model, name, source)?;
        if let Some(table) = &table.bending {
            list.push(one(link, name.get_ref(), table, source)?);
        }
    }
    Ok(list)
}

fn one(
    link: LinkId,
    name: &str,
    spanned: &Spanned<BendingTable>,
    source: Source,
) -> Result<Bending, UrdfError> {
    let table = spanned.get_ref();
    let number = |value: &Option<Spanned<_>>, key: &str, domain| {
        value.as_ref().map(|v| source.number(v, &format!("links.{name}.bending.{key}"), domain)).transpose()
    };
    let springs = number(&table.springs, "springs", Domain::Count)?.unwrap_or(1.0) as usize;
    let length = number(&table.length, "length", Domain::Positive)?;
    let flexural_rigidity = number(&table.flexural_rigidity, "EI", Domain::Positive)?;
    let stiffness = number(&table.stiffness, "stiffness", Domain::Positive)?;
    let mass_per_length =
        number(&table.mass_per_length, "mass_per_length", Domain::NotNegative)?.unwrap_or(0.0);
    let damping_ratio = number(&table.damping_ratio, "damping_ratio", Domain::NotNegative)?.unwrap_or(0.0);
    if flexural_rigidity.is_some() == stiffness.is_some() {
        let both = stiffness.is_some();
        let what =
            format!("links.{name}.bending: {}", if both { "stiffness stated twice" } else { "no stiffness" });
        let got = if both { "EI and stiffness" } else { "neither EI nor stiffness" };
        let help = "EI in N·m² for a beam of several springs, stiffness in N·m/rad for one base spring";
        return Err(source.value(spanned.span(), what, got.to_owned(), "one of the two", help));
    }
    if stiffness.is_some() && springs != 1 {
        let what = format!("links.{name}.bending: stiffness means a single base spring");
        let help = "state EI instead, or springs = 1";
        return Err(source.value(spanned.span(), what, format!("springs = {springs}"), "springs = 1", help));
    }
    if length.is_none() && (flexural_rigidity.is_some() || mass_per_length > 0.0) {
        let what = format!("length in [links.{name}.bending]");
        return Err(UrdfError::Missing {
            at: source.at(spanned.span()),
            what,
            help: "add length = …, in m".to_owned(),
        });
    }
    Ok(Bending {
        link,
        springs,
        axes: axes(name, &table.axes, source)?,
        length: length.unwrap_or(0.0),
        flexural_rigidity,
        stiffness,
        mass_per_length,
        damping_ratio,
    })
}

fn axes(name: &str, list: &Spanned<Vec<Spanned<String>>>, source: Source) -> Result<Vec<char>, UrdfError> {
    let bad = |span, what: &str, got: String| {
        let help = "name each axis of the link frame once";
        source.value(span, format!("links.{name}.bending.axes: {what}"), got, "\"x\", \"y\", \"z\"", help)
    };
    let mut axes = Vec::new();
    for word in list.get_ref() {
        let axis = match word.get_ref().as_str() {
            "x" => 'x',
            "y" => 'y',
            "z" => 'z',
            other => return Err(bad(word.span(), "no such axis", format!("\"{other}\""))),
        };
        if axes.contains(&axis) {
            return Err(bad(word.span(), "an axis twice", format!("\"{axis}\"")));
        }
        axes.push(axis);
    }
    if axes.is_empty() {
        return Err(bad(list.span(), "no axis", "[]".to_owned()));
    }
    Ok(axes)
}
