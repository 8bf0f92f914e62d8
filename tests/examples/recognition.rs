//! Prints the recognition tables: effects hidden in turn, in pairs, causes from outside the catalogue, nothing, and all of
//! them in arms and conditions by chance.
//!
//! ```text
//! cargo run --release -p sinew-tests --example recognition -- effects|turns|pairs|families|foreign|nothing|drawn|described [KEY=VALUE…]
//!     seeds=FIRST..END   arms=1,2,6,1-rigid,…   sensors=full,motor,current,link,all   encoders=fine,coarse,fine+read+places,fine/10,fine@4   sizes=1,0.3   only=EFFECT
//!     (+read: a noise of torques that is read and does not act; +fourier, +places, +slow: other motions; fine/10: every tenth row of
//!     the log; fine@4: a drive that holds its torques for 4 ms, and a log of that rate)
//!     urdfs=FILE,FILE      (described) arms of these files, a file for each seed in turn, with drives and conditions by chance
//!     into=docs/recognition.md   as=NAME      the tables go between <!-- NAME --> and <!-- /NAME --> of that page
//! ```

use std::fmt::Write;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;

use sinew_identify::{Options, Verdict};
use sinew_simulate::Stream;
use sinew_tests::{
    Arm, Case, Conditions, Hidden, Outcome, Outside, Sensors, are_twins, confusion, described_case,
    drawn_case, foreign_causes, hidden_effects, judge, null_case, turns_of_motor,
};

type Failure = Outside;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let asked = args.first().map(String::as_str).unwrap_or_default();
    let part = PARTS.iter().find(|(name, ..)| *name == asked);
    let (Some((name, draw, print)), Some(population)) =
        (part, Population::asked(args.get(1..).unwrap_or(&[])))
    else {
        return Err("usage: recognition effects|turns|pairs|families|foreign|nothing|drawn|described [seeds=0..3] [arms=1,2,6,1-rigid,…] [sensors=full,motor,current,link,all] [encoders=fine,coarse,fine+read+places,fine/10,fine@4] [sizes=1] [only=EFFECT] [urdfs=FILE,FILE] [into=PAGE [as=NAME]]".into());
    };
    let tables = population.tables(&args, *draw, *print)?;
    println!("{tables}");
    if let Some(page) = &population.into {
        insert(page, population.name.as_deref().unwrap_or(name), &tables)?;
    }
    Ok(())
}

type Draw = fn(&Population) -> Result<Vec<Asked>, Failure>;
type Print = fn(&[Judged]) -> String;

/// The parts of the suite: their cases, and what is printed of them.
const PARTS: [(&str, Draw, Print); 8] = [
    ("effects", |p| Ok(p.combined(single)), strata),
    ("turns", |p| Ok(p.combined(turns)), strata),
    ("pairs", |p| Ok(p.combined(pairs)), both),
    ("families", |p| Ok(p.combined(families)), both),
    ("foreign", |p| Ok(p.combined(foreign)), names),
    ("nothing", |p| Ok(p.combined(nothing)), alarms),
    ("drawn", |p| Ok(drawn(p)), strata),
    ("described", described, strata),
];

// What is drawn: every combination of these.
struct Population {
    seeds: Range<u64>,
    arms: Vec<Arc<Arm>>,
    conditions: Vec<(String, Conditions)>,
    sizes: Vec<f64>,
    only: Option<String>,
    // Of arms by chance; none where they are by chance too.
    sensors: Vec<Option<Sensors>>,
    urdfs: Vec<PathBuf>,
    into: Option<String>,
    name: Option<String>,
}

// A case with its arm, and the rows of a table in which it counts.
struct Asked {
    arm: Arc<Arm>,
    case: Case,
    groups: Vec<String>,
}

// A case with its answer.
struct Judged {
    case: Case,
    outcome: Outcome,
    groups: Vec<String>,
}

impl Population {
    fn asked(args: &[String]) -> Option<Self> {
        let word = |key: &str| args.iter().find_map(|a| a.strip_prefix(key)?.strip_prefix('='));
        let words = |key: &str, default: &'static str| -> Vec<String> {
            word(key).unwrap_or(default).split(',').map(str::to_owned).collect()
        };
        if args.iter().any(|a| !a.contains('=')) {
            return None;
        }
        let (first, end) = word("seeds").unwrap_or("0..3").split_once("..")?;
        let arms = words("arms", "1,2").iter().map(|n| Arm::named(n).map(Arc::new)).collect::<Option<_>>()?;
        let sensors = match word("sensors") {
            Some(list) => {
                list.split(',').map(|name| Sensors::named(name).map(Some)).collect::<Option<_>>()?
            }
            None => vec![None],
        };
        let mut conditions = Vec::new();
        for sensors in words("sensors", "full") {
            for encoder in words("encoders", "fine") {
                conditions.push((format!("{sensors}, {encoder}"), Conditions::named(&sensors, &encoder)?));
            }
        }
        Some(Self {
            seeds: first.parse().ok()?..end.parse().ok()?,
            arms,
            conditions,
            sizes: words("sizes", "1").iter().map(|s| s.parse().ok()).collect::<Option<_>>()?,
            only: word("only").map(str::to_owned),
            sensors,
            urdfs: word("urdfs").map_or(vec![], |list| list.split(',').map(PathBuf::from).collect()),
            into: word("into").map(str::to_owned),
            name: word("as").map(str::to_owned),
        })
    }

    // Judges all and prints them; a line for each case goes to standard error as it ends.
    fn tables(&self, args: &[String], draw: Draw, print: Print) -> Result<String, Failure> {
        let judge = |Asked { arm, case, groups }: Asked| Judged { outcome: ask(&arm, &case), case, groups };
        let judged: Vec<Judged> = draw(self)?.into_par_iter().map(judge).collect();
        let asked: Vec<&str> = args
            .iter()
            .map(String::as_str)
            .filter(|a| !a.starts_with("into") && !a.starts_with("as="))
            .collect();
        let mut text = format!("`recognition -- {}`\n\n", asked.join(" "));
        text += &print(&judged);
        Ok(text)
    }

    // The cases of every arm in every condition.
    fn combined(&self, draw: fn(&Self, &Arm, Conditions) -> Vec<Case>) -> Vec<Asked> {
        let mut all = Vec::new();
        for arm in &self.arms {
            for (conditions, sensors) in &self.conditions {
                let group = format!("{}, {conditions}", arm.robot.model.name.replace('_', " "));
                let of = |case| Asked { arm: Arc::clone(arm), case, groups: vec![group.clone()] };
                all.extend(draw(self, arm, *sensors).into_iter().map(of));
            }
        }
        all
    }

    // The effects that this part may hide.
    fn hidden(&self, arm: &Arm, dof: usize, size: f64, conditions: Conditions) -> Vec<Hidden> {
        let all = hidden_effects(arm, dof, size).into_iter();
        let seen = all.filter(|h| h.is_seen_by(conditions.sensors));
        seen.filter(|h| self.only.as_ref().is_none_or(|o| h.effect == o)).collect()
    }

    // Every seed with its joint and every size.
    fn draws(&self, arm: &Arm) -> Vec<(u64, usize, f64)> {
        let joints = arm.robot.model.nv;
        self.seeds
            .clone()
            .flat_map(|s| self.sizes.iter().map(move |&z| (s, s as usize % joints, z)))
            .collect()
    }
}

fn single(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    let draws = population.draws(arm).into_iter();
    draws
        .flat_map(|(seed, dof, size)| {
            let hidden = population.hidden(arm, dof, size, conditions);
            hidden.iter().map(|h| Case::new(arm, &[h], conditions, seed)).collect::<Vec<_>>()
        })
        .collect()
}

fn turns(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    let of = |(seed, dof, size)| {
        let mut hidden = turns_of_motor(arm, dof, size);
        hidden.retain(|h| population.only.as_ref().is_none_or(|o| h.effect == o));
        hidden.iter().map(|h| Case::new(arm, &[h], conditions, seed)).collect::<Vec<_>>()
    };
    population.draws(arm).into_iter().flat_map(of).collect()
}

// Two different effects at random joints, a pair for each seed; twins that no motion separates are not drawn.
fn pairs(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    let draws = population.draws(arm).into_iter();
    draws
        .map(|(seed, _, size)| {
            let random = Stream::new(seed, "pair");
            let pick = |k: u64, n: usize| ((random.uniform(k) * n as f64) as usize).min(n - 1);
            let mut drawn = (0..).map(|k| {
                let one = |k: u64| {
                    let mut all = population.hidden(arm, pick(4 * k, arm.robot.model.nv), size, conditions);
                    all.swap_remove(pick(4 * k + 1, all.len()))
                };
                (one(2 * k), one(2 * k + 1))
            });
            let (a, b) = drawn.find(|(a, b)| !are_twins(a.effect, b.effect)).expect("the draws do not end");
            Case::new(arm, &[&a, &b], conditions, seed)
        })
        .collect()
}

// What is offered, or shows, only beside another that is missing, too: parent and child in one joint.
const FAMILIES: [[&str; 2]; 12] = [
    ["coulomb_friction", "presliding_friction"],
    ["coulomb_friction", "stribeck_friction"],
    ["coulomb_friction", "load_dependent_friction"],
    ["coulomb_friction", "asymmetric_friction"],
    ["viscous_friction", "quadratic_viscous_friction"],
    ["joint_elasticity", "actuator_delay"],
    ["joint_elasticity", "actuator_lag"],
    ["joint_elasticity", "backlash"],
    ["joint_elasticity", "transmission_hysteresis"],
    ["joint_elasticity", "stiffness_hardening"],
    ["joint_elasticity", "coulomb_friction"],
    ["coulomb_friction", "balancer_spring"],
];

fn families(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    let of_draw = |(seed, dof, size)| {
        let all = population.hidden(arm, dof, size, conditions);
        let find = |name: &str| all.iter().find(|h| h.effect == name);
        let pairs = FAMILIES.iter().filter_map(|[parent, child]| Some([find(parent)?, find(child)?]));
        pairs.map(|pair| Case::new(arm, &pair, conditions, seed)).collect::<Vec<_>>()
    };
    population.draws(arm).into_iter().flat_map(of_draw).collect()
}

fn foreign(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    let draws = population.draws(arm).into_iter();
    draws
        .flat_map(|(seed, dof, size)| {
            let causes = foreign_causes(arm, dof, size);
            let wanted = causes.iter().filter(|c| population.only.as_ref().is_none_or(|o| c.name == o));
            wanted.map(|c| Case::foreign(arm, c, dof, conditions, seed)).collect::<Vec<_>>()
        })
        .collect()
}

fn nothing(population: &Population, arm: &Arm, conditions: Conditions) -> Vec<Case> {
    population.seeds.clone().map(|seed| null_case(arm, conditions, 100_000 + seed)).collect()
}

// Arms and conditions by chance, a case for each seed, size and set of sensors.
fn drawn(population: &Population) -> Vec<Asked> {
    let of = |(seed, size, sensors): (u64, f64, Option<Sensors>)| {
        let (arm, case) = drawn_case(seed, size, population.only.as_deref(), sensors);
        let mut groups = vec![arm.robot.model.name.replace('_', " ")];
        groups.extend(case.conditions.factors());
        Asked { arm: Arc::new(arm), case, groups }
    };
    let kinds = || population.sizes.iter().flat_map(|&z| population.sensors.iter().map(move |&s| (z, s)));
    population.seeds.clone().flat_map(|seed| kinds().map(move |(z, s)| (seed, z, s))).map(of).collect()
}

// Arms of URDF files, a file for each seed in turn, with drives and conditions by chance.
fn described(population: &Population) -> Result<Vec<Asked>, Failure> {
    let of = |seed: u64, size: f64| {
        let files = population.urdfs.len() as u64;
        let path =
            seed.checked_rem(files).map(|k| &population.urdfs[k as usize]).ok_or("urdfs= names no file")?;
        let (arm, case) = described_case(path, seed, size, population.only.as_deref())?;
        let joints = if arm.is_rigid() { "rigid joints" } else { "elastic joints" };
        let mut groups = vec![arm.robot.model.name.clone(), joints.to_owned()];
        groups.extend(case.conditions.factors());
        Ok(Asked { arm: Arc::new(arm), case, groups })
    };
    let sizes = |seed| population.sizes.iter().map(move |&size| (seed, size));
    population.seeds.clone().flat_map(sizes).map(|(seed, size)| of(seed, size)).collect()
}

// A case that fails is a miss.
fn ask(arm: &Arm, case: &Case) -> Outcome {
    let begun = Instant::now();
    let outcome = judge(arm, case, &Options::default()).map(|(outcome, _)| outcome).unwrap_or_else(|error| {
        eprintln!("seed {} {:?}: {error}", case.seed, case.hidden);
        Outcome {
            hidden: case.hidden.clone(),
            verdict: Verdict::Undecidable,
            first: None,
            contribution: 0.0,
            accepted: Vec::new(),
            rivals: Vec::new(),
        }
    });
    let mark = if case.is_right(&outcome) { ' ' } else { '!' };
    eprintln!(
        "{mark} {:.0} s {} seed {} {:?} {:?} rho {:.2} → {} {:?} {:?}",
        begun.elapsed().as_secs_f64(),
        arm.robot.model.name,
        case.seed,
        case.conditions.factors(),
        case.hidden,
        outcome.contribution,
        outcome.verdict,
        outcome.first,
        outcome.accepted
    );
    outcome
}

// Groups in the order in which they were drawn.
fn groups(judged: &[Judged]) -> Vec<(&str, Vec<&Judged>)> {
    let mut groups: Vec<(&str, Vec<&Judged>)> = Vec::new();
    for (j, group) in judged.iter().flat_map(|j| j.groups.iter().map(move |g| (j, g))) {
        match groups.iter_mut().find(|(name, _)| name == group) {
            Some((_, rows)) => rows.push(j),
            None => groups.push((group, vec![j])),
        }
    }
    groups
}

// Contribution in units of filtered noise: below 0.3 the right answer may be "adequate".
const STRATA: [(f64, f64, &str); 4] =
    [(0.0, 0.3, "below 0.3"), (0.3, 1.0, "0.3 to 1"), (1.0, 3.0, "1 to 3"), (3.0, f64::INFINITY, "above 3")];

fn strata(judged: &[Judged]) -> String {
    let right = |rows: &[&Judged]| {
        let right: Vec<_> = rows.iter().filter(|j| j.case.is_right(&j.outcome)).collect();
        let extra = right.iter().filter(|j| j.outcome.accepted.len() > 1).count();
        format!("{} of {} | {extra}", right.len(), rows.len())
    };
    let mut text = String::from("| cases | right first | of them with an extra effect |\n|---|---|---|\n");
    for (group, rows) in groups(judged) {
        let _ = writeln!(text, "| {group} | {} |", right(&rows));
    }
    for (least, most, name) in STRATA {
        let inside = |j: &&Judged| (least..most).contains(&j.outcome.contribution);
        let rows: Vec<&Judged> = judged.iter().filter(inside).collect();
        let _ = writeln!(text, "| ρ {name} | {} |", right(&rows));
    }
    let seen: Vec<&Judged> = judged.iter().filter(|j| j.outcome.contribution >= 0.3).collect();
    let _ = writeln!(text, "| ρ of 0.3 and more | {} |", right(&seen));
    text + &matrix(judged)
}

fn both(judged: &[Judged]) -> String {
    let mut text =
        String::from("| cases | both found | one first | neither | `adequate` |\n|---|---|---|---|---|\n");
    for (group, rows) in groups(judged) {
        let count = |f: fn(&&&Judged) -> bool| rows.iter().filter(f).count();
        let complete = count(|j| j.case.is_complete(&j.outcome));
        let first = count(|j| j.case.is_right(&j.outcome) && !j.case.is_complete(&j.outcome));
        let adequate = count(|j| j.outcome.verdict == Verdict::Adequate);
        let neither = rows.len() - complete - first - adequate;
        let _ =
            writeln!(text, "| {group} | {complete} of {} | {first} | {neither} | {adequate} |", rows.len());
    }
    text
}

// A name of which the diagnosis is sure.
const SURE: f64 = 0.8;

fn names(judged: &[Judged]) -> String {
    let mut text = String::from(
        "| cases | named with P ≥ 0.8 | named with less | `adequate` | no name |\n|---|---|---|---|---|\n",
    );
    for (group, rows) in groups(judged) {
        let sure = rows.iter().filter(|j| j.outcome.first.as_ref().is_some_and(|f| f.2 >= SURE)).count();
        let named = rows.iter().filter(|j| j.outcome.first.is_some()).count();
        let adequate = rows.iter().filter(|j| j.outcome.verdict == Verdict::Adequate).count();
        let rest = rows.len() - named - adequate;
        let _ =
            writeln!(text, "| {group} | {sure} of {} | {} | {adequate} | {rest} |", rows.len(), named - sure);
    }
    text + &matrix(judged)
}

fn alarms(judged: &[Judged]) -> String {
    let mut text = String::from("| cases | not `adequate` |\n|---|---|\n");
    for (group, rows) in groups(judged) {
        let alarms = rows.iter().filter(|j| j.outcome.verdict != Verdict::Adequate).count();
        let _ = writeln!(text, "| {group} | {alarms} of {} |", rows.len());
    }
    text
}

// The confusion matrix as rows: what is hidden, and what was named first how often; in one row what was never named
// otherwise.
fn matrix(judged: &[Judged]) -> String {
    let outcomes: Vec<Outcome> = judged.iter().map(|j| j.outcome.clone()).collect();
    let mut text = String::from("\n| hidden | named first |\n|---|---|\n");
    let mut always: Vec<String> = Vec::new();
    for (hidden, row) in confusion(&outcomes) {
        if let [(name, _)] = &row[..]
            && *name == hidden
        {
            always.push(format!("`{hidden}`"));
            continue;
        }
        let named: Vec<String> = row.iter().map(|(name, count)| format!("`{name}` {count}")).collect();
        let _ = writeln!(text, "| `{hidden}` | {} |", named.join(", "));
    }
    if !always.is_empty() {
        let _ = writeln!(text, "| {} | itself every time |", always.join(", "));
    }
    text
}

// Replaces what stands between the marks of a page.
fn insert(page: &str, name: &str, tables: &str) -> Result<(), Failure> {
    let text = std::fs::read_to_string(page)?;
    let (begin, end) = (format!("<!-- {name} -->"), format!("<!-- /{name} -->"));
    let lacks = || format!("{page}: the marks {begin} and {end} do not stand in it");
    let first = text.find(&begin).ok_or_else(lacks)? + begin.len();
    let last = first + text[first..].find(&end).ok_or_else(lacks)?;
    std::fs::write(page, format!("{}\n{tables}{}", &text[..first], &text[last..]))?;
    Ok(())
}
