//! The catalogue as a whole: names that hang together, and the printed page.

use std::path::Path;

use sinew_effect::{Ask, PlaceKind, Requirement, Screening, Site};
use sinew_effects::{CATALOGUE, markdown};
use sinew_model::{EffectSpec, LinkId, Place, samples};

#[test]
fn every_name_is_there_once() {
    for (k, entry) in CATALOGUE.entries.iter().enumerate() {
        let name = entry.card.name;
        assert!(!CATALOGUE.entries[..k].iter().any(|e| e.card.name == name), "{name} is there twice");
    }
}

#[test]
fn every_rival_and_every_parent_is_in_the_catalogue() {
    for entry in CATALOGUE.entries {
        let name = entry.card.name;
        for rival in entry.card.rivals {
            assert!(CATALOGUE.find(rival.name).is_some(), "{name}: its rival {} is unknown", rival.name);
        }
        for requirement in entry.card.requires {
            if let Requirement::Parent(parent) = requirement {
                assert!(CATALOGUE.find(parent).is_some(), "{name}: its parent {parent} is unknown");
            }
        }
        if let Screening::Release { effect, parameter } = entry.card.screening {
            let card = CATALOGUE.find(effect).expect("the released effect is in the catalogue").card;
            assert!(card.parameter(parameter).is_some(), "{name}: {effect} has no `{parameter}`");
        }
    }
}

#[test]
fn every_entry_makes_the_effect_of_its_card_or_says_why_not() {
    let model = samples::planar_arm(2, 1.5, 0.4);
    let tool = model.last_link();
    for entry in CATALOGUE.entries {
        let (site, place) = match entry.place {
            PlaceKind::Joint => (Site::Dof(1), Place::Joint("joint_2".to_owned())),
            PlaceKind::Link => (Site::Link(tool), Place::Link("link_2".to_owned())),
            PlaceKind::Robot => (Site::Robot, Place::Robot),
        };
        let spec = EffectSpec::new(entry.card.name, place);
        let hinge = entry.hinge.map(|_| 1);
        match (entry.build)(&Ask { model: &model, tool, site, spec: &spec, hinge }) {
            Ok(effect) => assert_eq!(effect.card().name, entry.card.name),
            Err(reason) => {
                assert!(matches!(entry.card.screening, Screening::Release { .. }));
                assert!(reason.contains("[joints.joint_2]"), "{reason}");
            }
        }
    }
}

#[test]
fn links_that_do_not_move_take_no_mass() {
    let model = samples::planar_arm(2, 1.5, 0.4);
    let entry = CATALOGUE.find("link_mass").expect("link_mass is in the catalogue");
    let spec = EffectSpec::new("link_mass", Place::Link("base".to_owned()));
    let ask =
        Ask { model: &model, tool: model.last_link(), site: Site::Link(LinkId(0)), spec: &spec, hinge: None };
    let reason = (entry.build)(&ask).expect_err("the base does not move");
    assert_eq!(reason, "link \"base\" does not move (it is fixed to the world)");
}

#[test]
fn the_printed_catalogue_is_up_to_date() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/effects.md");
    let page = markdown();
    if std::env::var_os("SINEW_BLESS").is_some() {
        std::fs::write(&path, &page).expect("docs/effects.md can be written");
    }
    let printed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        printed == page,
        "docs/effects.md is old: SINEW_BLESS=1 cargo test -p sinew-effects prints it anew"
    );
}
