//! `[links.L.bending]`: links that bend or twist.

use serde_spanned::Spanned;
use sinew_model::{BeamSection, Bending, LinkId, Model, Vector3};

use crate::UrdfError;
use crate::assembly::require_link;
use crate::grammar::{BendingTable, Entries, LinkTable, Number, SectionTable};
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
    let sections = sections(name, table, source)?;
    let (stations, stiffnesses) = listed(name, table, source)?;
    let stated = number(&table.length, "length", Domain::Positive)?;
    let bending = Bending {
        link,
        springs: number(&table.springs, "springs", Domain::Count)?.unwrap_or(1.0) as usize,
        axes: axes(name, &table.axes, source)?,
        along: along(name, &table.along, source)?,
        length: stated.unwrap_or_else(|| sections.iter().map(|s| s.length).sum()),
        flexural_rigidity: number(&table.flexural_rigidity, "EI", Domain::Positive)?,
        torsional_rigidity: number(&table.torsional_rigidity, "GJ", Domain::Positive)?,
        stiffness: number(&table.stiffness, "stiffness", Domain::Positive)?,
        mass_per_length: number(&table.mass_per_length, "mass_per_length", Domain::NotNegative)?
            .unwrap_or(0.0),
        polar_inertia_per_length: number(
            &table.polar_inertia_per_length,
            "polar_inertia_per_length",
            Domain::NotNegative,
        )?
        .unwrap_or(0.0),
        damping_ratio: number(&table.damping_ratio, "damping_ratio", Domain::NotNegative)?.unwrap_or(0.0),
        quasi_static: table.quasi_static.as_ref().is_some_and(|q| *q.get_ref()),
        sections,
        stations,
        stiffnesses,
    };
    one_stiffness(name, spanned, &bending, source)?;
    whole_length(name, spanned, &bending, source)?;
    Ok(bending)
}

// Exactly one of the ways to state how stiff a link is.
fn one_stiffness(
    name: &str,
    spanned: &Spanned<BendingTable>,
    bending: &Bending,
    source: Source,
) -> Result<(), UrdfError> {
    let ways = [
        ("EI", bending.flexural_rigidity.is_some()),
        ("stiffness", bending.stiffness.is_some()),
        ("sections", !bending.sections.is_empty()),
        ("stiffnesses", !bending.stiffnesses.is_empty()),
    ];
    let stated: Vec<&str> = ways.iter().filter(|(_, stated)| *stated).map(|(key, _)| *key).collect();
    if stated.len() != 1 {
        let both = stated.len() > 1;
        let what =
            format!("links.{name}.bending: {}", if both { "stiffness stated twice" } else { "no stiffness" });
        let got = if both { stated.join(" and ") } else { "neither EI nor stiffness".to_owned() };
        let help = "EI in N·m² for a beam of several springs, stiffness in N·m/rad for one base spring; or sections, or stations with stiffnesses";
        return Err(source.value(spanned.span(), what, got, "one of the two", help));
    }
    if bending.stiffness.is_some() && bending.springs != 1 {
        let what = format!("links.{name}.bending: stiffness means a single base spring");
        let help = "state EI instead, or springs = 1";
        let got = format!("springs = {}", bending.springs);
        return Err(source.value(spanned.span(), what, got, "springs = 1", help));
    }
    Ok(())
}

fn whole_length(
    name: &str,
    spanned: &Spanned<BendingTable>,
    bending: &Bending,
    source: Source,
) -> Result<(), UrdfError> {
    let needs = bending.flexural_rigidity.is_some() || bending.mass_per_length > 0.0;
    if bending.length == 0.0 && needs {
        let what = format!("length in [links.{name}.bending]");
        return Err(UrdfError::Missing {
            at: source.at(spanned.span()),
            what,
            help: "add length = …, in m".to_owned(),
        });
    }
    let sum: f64 = bending.sections.iter().map(|s| s.length).sum();
    // lengths are stated to a few digits
    if !bending.sections.is_empty() && (sum - bending.length).abs() > 1e-6 * sum {
        let what = format!("links.{name}.bending: sections of another length than the link's");
        let help = "leave length out, or let the sections make it up";
        return Err(source.value(
            spanned.span(),
            what,
            format!("{sum} m"),
            &format!("{} m", bending.length),
            help,
        ));
    }
    Ok(())
}

fn sections(name: &str, table: &BendingTable, source: Source) -> Result<Vec<BeamSection>, UrdfError> {
    let Some(list) = &table.sections else { return Ok(Vec::new()) };
    let one = |(k, section): (usize, &Spanned<SectionTable>)| {
        let s = section.get_ref();
        let number = |value: &Spanned<_>, key: &str, domain| {
            source.number(value, &format!("links.{name}.bending.sections[{k}].{key}"), domain)
        };
        let optional = |value: &Option<Spanned<_>>, key: &str, domain| {
            value.as_ref().map(|v| number(v, key, domain)).transpose()
        };
        Ok(BeamSection {
            length: number(&s.length, "length", Domain::Positive)?,
            flexural_rigidity: number(&s.flexural_rigidity, "EI", Domain::Positive)?,
            torsional_rigidity: optional(&s.torsional_rigidity, "GJ", Domain::Positive)?,
            mass_per_length: optional(&s.mass_per_length, "mass_per_length", Domain::NotNegative)?
                .unwrap_or(0.0),
            polar_inertia_per_length: optional(
                &s.polar_inertia_per_length,
                "polar_inertia_per_length",
                Domain::NotNegative,
            )?
            .unwrap_or(0.0),
        })
    };
    list.get_ref().iter().enumerate().map(one).collect()
}

// Springs one by one: where each stands and how stiff it is.
fn listed(name: &str, table: &BendingTable, source: Source) -> Result<(Vec<f64>, Vec<f64>), UrdfError> {
    let numbers = |list: &Option<Spanned<Vec<Number>>>, key: &str| match list {
        None => Ok(Vec::new()),
        Some(list) => source.numbers(list, &format!("links.{name}.bending.{key}")),
    };
    let (stations, stiffnesses) =
        (numbers(&table.stations, "stations")?, numbers(&table.stiffnesses, "stiffnesses")?);
    let span = table.stations.as_ref().or(table.stiffnesses.as_ref()).map(Spanned::span);
    let ascending = stations.windows(2).all(|w| w[0] < w[1]) && stations.first().is_none_or(|s| *s >= 0.0);
    let good = stations.len() == stiffnesses.len() && ascending && stiffnesses.iter().all(|k| *k > 0.0);
    match span {
        Some(span) if !good => {
            let what = format!("links.{name}.bending: springs one by one need a place and a stiffness each");
            let got = format!("stations {stations:?}, stiffnesses {stiffnesses:?}");
            let help = "stations in m from the link's origin, ascending; stiffnesses in N·m/rad, as many";
            Err(source.value(span, what, got, "as many of each, ascending and positive", help))
        }
        _ => Ok((stations, stiffnesses)),
    }
}

fn along(
    name: &str,
    word: &Option<Spanned<String>>,
    source: Source,
) -> Result<Option<Vector3<f64>>, UrdfError> {
    let Some(word) = word else { return Ok(None) };
    let text = word.get_ref();
    let axis = match text.trim_start_matches('-') {
        "x" => Vector3::new(1.0, 0.0, 0.0),
        "y" => Vector3::new(0.0, 1.0, 0.0),
        "z" => Vector3::new(0.0, 0.0, 1.0),
        _ => {
            let what = format!("links.{name}.bending.along: no such axis");
            let help = "name the axis of the link frame along which the link runs";
            return Err(source.value(
                word.span(),
                what,
                format!("\"{text}\""),
                "\"x\", \"-x\", \"y\", \"-y\", \"z\", \"-z\"",
                help,
            ));
        }
    };
    Ok(Some(if text.starts_with('-') { -axis } else { axis }))
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
