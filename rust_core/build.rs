//! Bakes the hash of the crate's sources into the library: part of every result's identity.
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

fn main() {
    let mut found = Vec::new();
    sources(Path::new("src"), &mut found);
    found.sort();
    let mut hash = Sha256::new();
    for path in found {
        hash.update(path.to_string_lossy().as_bytes());
        hash.update(std::fs::read(&path).expect("a source file can be read"));
    }
    let hex: String = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    println!("cargo:rustc-env=RAILUI_SOURCES={hex}");
    println!("cargo:rerun-if-changed=src");
}
