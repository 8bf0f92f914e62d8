//! Prints the tables of docs/links.md: how lumped springs converge to the beam.
#![allow(non_snake_case, dead_code)]

#[path = "../tests/beam/robots.rs"]
mod robots;
#[path = "../tests/beam/table.rs"]
mod table;

fn main() {
    print!("{}", table::tables());
}
