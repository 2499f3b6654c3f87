//! Each module may use only those above it in the list of lib.rs.
use std::path::Path;

#[test]
fn a_module_uses_only_those_above_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = std::fs::read_to_string(src.join("lib.rs")).expect("lib.rs");
    let order: Vec<&str> = lib
        .lines()
        .filter_map(|l| l.trim_start_matches("pub ").strip_prefix("mod ").and_then(|l| l.strip_suffix(';')))
        .collect();
    assert!(order.len() > 8, "{order:?}");
    for (floor, name) in order.iter().enumerate() {
        let mut files = vec![src.join(format!("{name}.rs"))];
        if let Ok(folder) = std::fs::read_dir(src.join(name)) {
            files.extend(folder.flatten().map(|f| f.path()));
        }
        for file in files.iter().filter(|f| f.exists()) {
            let text = std::fs::read_to_string(file).expect("a source file");
            let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            for above in &order[floor + 1..] {
                assert!(
                    !code.contains(&format!("crate::{above}")),
                    "{} uses {above}, which is above it",
                    file.display()
                );
            }
        }
    }
}
