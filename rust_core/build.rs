//! Bakes the hash of the crate's sources into the library, part of every result's identity, and takes in a law that stands
//! in a file elsewhere, and straight code for the rows of known structures.
mod structures;

use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the crate has a src folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The law of a file that `RAILUI_EFFECT` names joins the catalogue as [`effects::more`].
fn more_effects(found: &mut Vec<PathBuf>) {
    println!("cargo:rustc-check-cfg=cfg(more_effects)");
    println!("cargo:rerun-if-env-changed=RAILUI_EFFECT");
    let Some(file) = std::env::var_os("RAILUI_EFFECT").map(PathBuf::from) else { return };
    println!("cargo:rerun-if-changed={}", file.display());
    println!("cargo:rustc-cfg=more_effects");
    let text = std::fs::read_to_string(&file).expect("RAILUI_EFFECT names a readable file");
    // an included file may not begin with the documentation of a module
    let law: String = text.lines().filter(|line| !line.starts_with("//!")).map(|line| format!("{line}\n")).collect();
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo names a folder"));
    std::fs::write(out.join("more.rs"), law).expect("the folder of cargo can be written");
    found.push(file);
}

fn main() {
    let mut found = Vec::new();
    sources(Path::new("src"), &mut found);
    found.sort();
    more_effects(&mut found);
    let straight = structures::straight_code();
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo names a folder"));
    std::fs::write(out.join("structures.rs"), &straight).expect("the folder of cargo can be written");
    let mut hash = Sha256::new();
    for path in found {
        hash.update(path.to_string_lossy().as_bytes());
        hash.update(std::fs::read(&path).expect("a source file can be read"));
    }
    hash.update(&straight);
    let hex: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    println!("cargo:rustc-env=RAILUI_SOURCES={hex}");
    for path in ["src", "structures", "structures.rs", "build.rs"] {
        println!("cargo:rerun-if-changed={path}");
    }
}
