//! Straight code for the rows of known structures: a file of `structures` says which rows read which places.
//!
//! A line is a block (`rate::plan::Block`): how many rows, where their sums go and where they start from, the places that
//! each term reads; a second set of ends has the same factors over other places, of which `-1 - place` is the opposite.
use std::fmt::Write;
use std::path::Path;

/// The columns of the input table that a row of it may tell from those times the speed.
const COLUMNS: isize = 64;

struct Block {
    rows: usize,
    ends: Vec<[usize; 2]>,
    terms: Vec<Vec<isize>>,
}

fn block(line: &str) -> Block {
    let [rows, ends, terms] = line.split(": ").collect::<Vec<_>>()[..] else { panic!("{line:?} is no block") };
    let number = |word: &str| word.parse().unwrap_or_else(|_| panic!("{word:?} in {line:?} is no number"));
    let end = |word: &str| {
        let (to, from) = word.split_once('<').unwrap_or_else(|| panic!("{word:?} in {line:?} is no end"));
        [to, from].map(|word| number(word) as usize)
    };
    Block {
        rows: number(rows) as usize,
        ends: ends.split(' ').map(end).collect(),
        terms: terms
            .split("; ")
            .filter(|term| !term.is_empty())
            .map(|term| term.split(' ').map(number).collect())
            .collect(),
    }
}

/// The name and the text of every file, in order.
fn files() -> Vec<(String, String)> {
    let files = std::fs::read_dir("structures").expect("the crate has a folder of structures").flatten();
    let mut files: Vec<_> =
        files.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "txt")).collect();
    files.sort();
    let read = |path: &Path| {
        let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        (name, std::fs::read_to_string(path).expect("a structure can be read"))
    };
    files.iter().map(|path| read(path)).collect()
}

/// The sums of some blocks as statements, each sum in a variable of its own, and the number of factors.
fn statements(blocks: &[Block], values: fn(isize) -> String, starts: bool) -> (String, usize) {
    let (mut code, mut first) = (String::new(), 0);
    for Block { rows, ends, terms } in blocks {
        for (i, [_, from]) in ends.iter().enumerate() {
            let start = if starts { format!("from[{from}]") } else { "P::zero()".into() };
            writeln!(code, "        let mut s{i} = {start};").expect("text");
        }
        for (k, term) in terms.iter().enumerate() {
            for (m, place) in term.iter().enumerate() {
                writeln!(code, "        let v = {};", values((*place).max(!place))).expect("text");
                for n in 0..*rows {
                    let (i, fused) = (m * rows + n, if *place < 0 { "neg_mul_add" } else { "mul_add" });
                    writeln!(code, "        s{i} = f[{}].{fused}(v, s{i});", first + k * rows + n).expect("text");
                }
            }
        }
        for (i, [to, _]) in ends.iter().enumerate() {
            writeln!(code, "        to[{to}] = s{i};").expect("text");
        }
        first += terms.len().next_multiple_of(2) * rows;
    }
    (code, first)
}

/// A constant of `rate::plan::Block`.
fn constant(block: &Block) -> String {
    let places = block.terms.concat();
    format!(
        "Block {{ rows: {}, ends: Cow::Borrowed(&{:?}), places: Cow::Borrowed(&{places:?}) }}",
        block.rows, block.ends
    )
}

/// An implementation of `rate::fused::Structure` per file, the list of what is known, and a choice among them.
pub fn straight_code() -> String {
    let (mut code, mut known, mut choices) = (String::new(), String::new(), String::new());
    for (i, (name, text)) in files().into_iter().enumerate() {
        let words = name.split('_').map(|word| word[..1].to_uppercase() + &word[1..]);
        let kind: String = words.collect();
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let size = lines.next().and_then(|line| line.strip_prefix("size ")).expect("degrees of freedom, states");
        let size = format!("({})", size.replace(' ', ", "));
        let mut lists: Vec<(&str, Vec<Block>)> = Vec::new();
        for line in lines {
            match lists.last_mut() {
                Some((_, blocks)) if line.contains(": ") => blocks.push(block(line)),
                _ => lists.push((line, Vec::new())),
            }
        }
        write!(code, "/// From `{name}.txt`.\nstruct {kind};\n\n#[allow(unused_mut, unused_variables)]\nimpl Structure for {kind} {{\n    const SIZE: Option<(usize, usize)> = Some({size});\n").expect("text");
        for (list, blocks) in &lists {
            let (head, value, starts): (_, fn(isize) -> String, _) = match *list {
                "wheelsets" => ("State>, x: &[P; STATES], from: &[P; STATES]", |i| format!("x[{i}]"), true),
                "bodies" => ("State>, x: &mut [P; STATES], from: &[P; STATES]", |i| format!("x[{i}]"), true),
                "track" => ("Table>, row: &[f64]", |i| format!("P::splat(row[{}])", i % COLUMNS), false),
                other => panic!("{other:?} is no list of blocks"),
            };
            let (sums, factors) = statements(blocks, value, starts);
            writeln!(
                code,
                "    #[inline(always)]\n    fn {list}<P: Part>(rows: &Packed<P, {head}, to: &mut [P; STATES]) {{"
            )
            .expect("text");
            writeln!(code, "        let Some(f) = rows.factors.first_chunk::<{factors}>() else {{ return }};")
                .expect("text");
            if *list == "track" {
                let read =
                    blocks.iter().flat_map(|block| block.terms.concat()).map(|i| i % COLUMNS).max().unwrap_or(0) + 1;
                writeln!(code, "        let Some(row) = row.first_chunk::<{read}>() else {{ return }};").expect("text");
            }
            writeln!(code, "{sums}    }}").expect("text");
        }
        code.push_str("}\n\n");
        let constants = lists.iter().map(|(_, blocks)| blocks.iter().map(constant).collect::<Vec<_>>().join(", "));
        let constants: Vec<_> = constants.map(|list| format!("&[{list}]")).collect();
        let (name, constants) = (name.replace('_', " "), constants.join(", "));
        writeln!(known, "    Known {{ name: {name:?}, size: {size}, blocks: [{constants}] }},").expect("text");
        writeln!(choices, "        Some({i}) => work.run::<{kind}>(),").expect("text");
    }
    format!(
        "{code}/// All of them.\npub const KNOWN: &[Known] = &[\n{known}];\n\n\
         /// Runs work for one of [`KNOWN`], or for any structure.\npub fn for_structure(known: Option<usize>, work: impl ForStructure) {{\n    \
         match known {{\n{choices}        _ => work.run::<AnyStructure>(),\n    }}\n}}\n"
    )
}
