//! Pages that list what the code has.

use sinew_data::{ColumnMap, Quantity};

const FILES: &str = include_str!("../../docs/files.md");

#[test]
fn the_page_of_files_lists_every_column() {
    let missing: Vec<&str> =
        Quantity::ALL.iter().map(|q| q.name()).filter(|name| !FILES.contains(&format!("`{name}."))).collect();
    assert!(missing.is_empty(), "docs/files.md does not name {missing:?}");
}

#[test]
fn the_map_of_the_page_is_one() {
    let map = FILES.split("```toml").find(|block| block.contains("stamp_ns")).unwrap();
    let map = map.split("```").next().unwrap();
    ColumnMap::parse(map, "docs/files.md").unwrap();
}
