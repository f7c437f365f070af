//! The modules of all crates by their files, and which file a name comes from.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;

use super::source::Source;

/// Names handed on more often than this are taken to run in a circle.
const MAX_DEPTH: usize = 32;

/// All modules of the crates.
#[derive(Debug, Default)]
pub struct Tree {
    /// Files in the order in which they were read.
    pub files: Vec<File>,
    /// Modules, parents before children.
    pub modules: Vec<Module>,
    /// Roots of libraries by the names that `use` calls them.
    pub libraries: BTreeMap<String, usize>,
}

/// A file.
#[derive(Debug)]
pub struct File {
    /// Its path from the directory of the crates.
    pub path: String,
    /// Name of its crate's directory.
    pub of_crate: String,
    /// Whether it only declares modules and hands on names.
    pub is_face: bool,
}

/// A module.
#[derive(Debug)]
pub struct Module {
    /// Index of its file.
    pub file: usize,
    /// What it says itself.
    pub source: Source,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
}

/// Where a path leads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// To a module.
    Module(usize),
    /// To something that a file defines.
    Item(usize),
}

/// Text of a file below the directory of the crates, none if there is no such file.
pub type Read<'a> = &'a dyn Fn(&Path) -> Option<String>;

impl Tree {
    /// Reads the library and the program of each crate, and the files of their modules.
    ///
    /// # Errors
    /// If a module has no file or a file is not Rust.
    pub fn read(crates: &[String], read: Read) -> anyhow::Result<Self> {
        let mut tree = Self::default();
        for name in crates {
            for root in ["lib.rs", "main.rs"] {
                let path = Path::new(name).join("src").join(root);
                let Some(text) = read(&path) else { continue };
                let module = tree.add_file(&path, &text, None, read)?;
                if root == "lib.rs" {
                    tree.libraries.insert(name.replace('-', "_"), module);
                }
            }
        }
        Ok(tree)
    }

    fn add_file(
        &mut self,
        path: &Path,
        text: &str,
        parent: Option<usize>,
        read: Read,
    ) -> anyhow::Result<usize> {
        let shown = path.display().to_string();
        let source = Source::read(text).with_context(|| shown.clone())?;
        let of_crate = shown.split('/').next().unwrap_or_default().to_owned();
        self.files.push(File {
            path: shown,
            of_crate,
            is_face: source.is_face(),
        });
        let name = path.file_stem().unwrap_or_default();
        let folder = path.parent().unwrap_or(path);
        let of_children = match name.to_str() {
            Some("lib" | "main" | "mod") => folder.to_path_buf(),
            _ => folder.join(name),
        };
        self.add(self.files.len() - 1, source, parent, &of_children, read)
    }

    /// Adds a module and its children, whose files are in a folder.
    fn add(
        &mut self,
        file: usize,
        mut source: Source,
        parent: Option<usize>,
        folder: &Path,
        read: Read,
    ) -> anyhow::Result<usize> {
        let modules = std::mem::take(&mut source.modules);
        let this = self.modules.len();
        self.modules.push(Module {
            file,
            source,
            parent,
            children: BTreeMap::new(),
        });
        for (name, inline) in modules {
            let child = if let Some(source) = inline {
                self.add(file, source, Some(this), &folder.join(&name), read)?
            } else {
                let (path, text) = module_file(folder, &name, read)?;
                self.add_file(&path, &text, Some(this), read)?
            };
            self.modules[this].children.insert(name, child);
        }
        Ok(this)
    }

    /// Where a path in a module leads; none if it leaves the workspace.
    ///
    /// A name that a module seems not to have, such as one made by a macro, is taken to be in its file.
    pub fn resolve(&self, module: usize, path: &[String]) -> Option<Place> {
        self.resolve_at(module, path, 0)
    }

    /// What a name means in a module.
    pub fn find(&self, module: usize, name: &str) -> Option<Place> {
        self.find_at(module, name, 0)
    }

    /// The library that a path begins with, if it begins with one.
    pub fn library(&self, module: usize, path: &[String]) -> Option<&str> {
        let first = path.first()?;
        let (name, root) = self.libraries.get_key_value(first)?;
        let is_it = self
            .find(module, first)
            .is_none_or(|place| place == Place::Module(*root));
        is_it.then_some(name.as_str())
    }

    /// The crate's root above a module.
    fn root(&self, module: usize) -> usize {
        let parent = self.modules[module].parent;
        parent.map_or(module, |parent| self.root(parent))
    }

    fn resolve_at(&self, module: usize, path: &[String], depth: usize) -> Option<Place> {
        let (first, rest) = path.split_first()?;
        let mut place = match first.as_str() {
            "crate" => Place::Module(self.root(module)),
            "self" => Place::Module(module),
            "super" => Place::Module(self.modules[module].parent?),
            name => self.find_at(module, name, depth + 1).or_else(|| {
                let root = self.libraries.get(name);
                root.map(|root| Place::Module(*root))
            })?,
        };
        for name in rest {
            let Place::Module(inside) = place else { break };
            place = match name.as_str() {
                "super" => Place::Module(self.modules[inside].parent?),
                name => {
                    let found = self.find_at(inside, name, depth + 1);
                    found.unwrap_or(Place::Item(self.modules[inside].file))
                }
            };
        }
        Some(place)
    }

    fn find_at(&self, module: usize, name: &str, depth: usize) -> Option<Place> {
        if depth > MAX_DEPTH {
            return None;
        }
        let Module {
            file,
            source,
            children,
            ..
        } = &self.modules[module];
        if let Some(child) = children.get(name) {
            return Some(Place::Module(*child));
        }
        if source.items.contains(name) {
            return Some(Place::Item(*file));
        }
        let (named, globs): (Vec<_>, Vec<_>) =
            (source.imports.iter()).partition(|import| import.name.is_some());
        let mut named = named
            .into_iter()
            .filter(|import| import.name.as_deref() == Some(name));
        named
            .find_map(|import| self.resolve_at(module, &import.path, depth + 1))
            .or_else(|| {
                globs.into_iter().find_map(|import| {
                    match self.resolve_at(module, &import.path, depth + 1)? {
                        Place::Module(inside) if inside != module => {
                            self.find_at(inside, name, depth + 1)
                        }
                        _ => None,
                    }
                })
            })
    }
}

/// The file of a module in a folder.
fn module_file(folder: &Path, name: &str, read: Read) -> anyhow::Result<(PathBuf, String)> {
    let paths = [
        folder.join(format!("{name}.rs")),
        folder.join(name).join("mod.rs"),
    ];
    let mut found = paths.into_iter().filter_map(|path| {
        let text = read(&path)?;
        Some((path, text))
    });
    let missing = || format!("module {name} has no file in {}", folder.display());
    found.next().with_context(missing)
}
