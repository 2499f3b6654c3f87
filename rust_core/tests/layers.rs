//! A module may use only those above it in the list that declares it: `lib.rs`, or the `mod.rs` of a folder.
use std::path::{Path, PathBuf};

/// Modules that a file declares, in its order.
fn declared(file: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let module = |line: &str| line.strip_prefix("pub mod ").and_then(|l| l.strip_suffix(';')).map(String::from);
    text.lines().filter_map(module).collect()
}

/// The Rust files of a module: its own, and those of its folder.
fn files_of(folder: &Path, name: &str) -> Vec<PathBuf> {
    let mut files = vec![folder.join(format!("{name}.rs"))];
    if let Ok(entries) = std::fs::read_dir(folder.join(name)) {
        for entry in entries.flatten() {
            let path = entry.path();
            if path.is_dir() {
                files.extend(std::fs::read_dir(&path).into_iter().flatten().flatten().map(|f| f.path()));
            } else {
                files.push(path);
            }
        }
    }
    files.retain(|file| file.is_file());
    files
}

/// Check that no module of a list uses one below it; `prefix` is the path of the list, as `crate::rate`.
fn check_order(folder: &Path, list: &str, prefix: &str) {
    let order = declared(&folder.join(list));
    for (position, name) in order.iter().enumerate() {
        for file in files_of(folder, name) {
            let text = std::fs::read_to_string(&file).expect("a source file");
            let code = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
            for later in &order[position + 1..] {
                let used = format!("{prefix}::{later}");
                let uses = code
                    .match_indices(&used)
                    .any(|(at, _)| !code[at + used.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_'));
                assert!(!uses, "{} uses {used}, which stands below it", file.display());
            }
        }
        if folder.join(name).is_dir() {
            check_order(&folder.join(name), "mod.rs", &format!("{prefix}::{name}"));
        }
    }
}

#[test]
fn a_module_uses_only_those_above_it() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    assert!(declared(&src.join("lib.rs")).len() > 8);
    assert!(declared(&src.join("rate/mod.rs")).len() > 5);
    check_order(&src, "lib.rs", "crate");
}

/// Files with a function that each step executes, and those of a vehicle beyond them (see docs/kernel.md).
const EVERY_STEP: [&str; 7] = [
    "simd/mod.rs",
    "simd/registers.rs",
    "integrate/steps.rs",
    "integrate/rk4.rs",
    "integrate/sample.rs",
    "wheel_rail/contact.rs",
    "effects/law.rs",
];
const OF_VEHICLE: [(&str, &[&str]); 7] = [
    ("bogie", &["rate/bogie.rs"]),
    ("bogie with a bump stop", &["rate/bogie.rs", "effects/port.rs", "effects/bump_stop.rs"]),
    ("bogie with dry friction", &["rate/bogie.rs", "effects/port.rs", "effects/dry_friction.rs", "simd/elementary.rs"]),
    ("coach and other vehicles of bodies, with stops", &["rate/fused.rs", "effects/port.rs", "effects/bump_stop.rs"]),
    (
        "bogie with the creep law of Vermeulen and Johnson",
        &["rate/bogie.rs", "wheel_rail/wheelset.rs", "effects/vermeulen_johnson.rs"],
    ),
    (
        "bogie on measured profiles with saturation",
        &["rate/bogie.rs", "wheel_rail/wheelset.rs", "effects/creep_saturation.rs", "numeric/profile_table.rs"],
    ),
    (
        "bogie with the creep law of Polach",
        &["rate/bogie.rs", "wheel_rail/wheelset.rs", "effects/polach.rs", "simd/elementary.rs"],
    ),
];
/// Of each vehicle above.
const MOST_FILES: usize = 11;
const MOST_LINES: usize = 2012;

/// Files and lines of a vehicle in the table of docs/kernel.md.
fn documented(page: &str, vehicle: &str) -> Option<(usize, usize)> {
    let counts = |row: &str| {
        let mut cells = row.trim_matches('|').split('|').skip(2).map(|cell| cell.trim().replace(',', ""));
        Some((cells.next()?.parse().ok()?, cells.next()?.parse().ok()?))
    };
    page.lines().filter(|line| line.starts_with(&format!("| {vehicle} |"))).find_map(counts)
}

#[test]
fn a_step_passes_through_few_lines() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("../docs/kernel.md")).expect("the page of the kernel");
    let lines = |file: &&str| {
        let text = std::fs::read_to_string(root.join("src").join(file)).expect("a source file");
        text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default().lines().count()
    };
    for (vehicle, further) in OF_VEHICLE {
        let files: Vec<_> = EVERY_STEP.iter().chain(further).collect();
        let sum: usize = files.iter().copied().map(lines).sum();
        assert_eq!(documented(&page, vehicle), Some((files.len(), sum)), "{vehicle}");
        assert!(files.len() <= MOST_FILES && sum <= MOST_LINES, "{sum} lines of {files:?}");
    }
}
