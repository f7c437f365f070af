//! Which file imports which names of which other file.

use std::collections::{BTreeMap, BTreeSet};

use super::source::Import;
use super::tree::{Place, Tree};

/// Names by the files that use and define them.
pub type Imports = BTreeMap<(usize, usize), BTreeSet<String>>;

/// Every import between files.
///
/// Inside a crate a face (a `mod.rs` or `lib.rs` that only declares and hands on) neither uses nor defines anything:
/// a name that is imported from it is that of the file behind it; and a file that hands a name on without using it
/// does not import it.
pub fn imports(tree: &Tree) -> Imports {
    let mut imports = Imports::new();
    for (module, of) in tree.modules.iter().enumerate() {
        let from = of.file;
        let words = &of.source.words;
        let mut add = |place: Option<Place>, name: &str, is_used: bool| {
            let to = match place {
                Some(Place::Item(file)) => file,
                Some(Place::Module(module)) => tree.modules[module].file,
                None => return,
            };
            let (source, target) = (&tree.files[from], &tree.files[to]);
            let is_code = is_used && !source.is_face && !target.is_face;
            if to != from && (is_code || source.of_crate != target.of_crate) {
                let names = imports.entry((from, to)).or_default();
                names.insert(name.to_owned());
            }
        };
        for import in &of.source.imports {
            if let Some(name) = &import.name {
                let is_used = !import.is_public || words.contains(name);
                add(tree.resolve(module, &import.path), name, is_used);
            } else {
                for (place, name) in behind_glob(tree, module, import, words) {
                    add(place, name, true);
                }
            }
        }
        for path in &of.source.paths {
            let name = path.last().map(String::as_str).unwrap_or_default();
            add(tree.resolve(module, path), name, true);
        }
    }
    imports
}

/// The names that a glob brings in and that its module uses.
fn behind_glob<'a>(
    tree: &Tree,
    module: usize,
    import: &Import,
    words: &'a BTreeSet<String>,
) -> Vec<(Option<Place>, &'a str)> {
    let Some(Place::Module(inside)) = tree.resolve(module, &import.path) else {
        return Vec::new();
    };
    words
        .iter()
        .map(|name| (tree.find(inside, name), name.as_str()))
        .collect()
}

/// Which libraries each crate uses, with the files that use them.
pub fn arrows(tree: &Tree) -> BTreeMap<(String, String), BTreeSet<usize>> {
    let mut arrows: BTreeMap<(String, String), BTreeSet<usize>> = BTreeMap::new();
    for (module, of) in tree.modules.iter().enumerate() {
        let imported = of.source.imports.iter().map(|import| &import.path);
        for path in imported.chain(&of.source.paths) {
            let own = tree.files[of.file].of_crate.as_str();
            let used = tree
                .library(module, path)
                .map(|name| name.replace('_', "-"));
            if let Some(used) = used.filter(|used| used != own) {
                let key = (own.to_owned(), used);
                arrows.entry(key).or_default().insert(of.file);
            }
        }
    }
    arrows
}
