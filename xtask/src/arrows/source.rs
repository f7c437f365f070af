//! What one module declares, imports and names, read from its tokens; what is compiled for tests alone is left out.

use std::collections::BTreeSet;

use anyhow::anyhow;
use proc_macro2::{Delimiter, Group, TokenStream, TokenTree};

/// Keywords after which a module declares the next name.
const DECLARATIONS: [&str; 8] = [
    "const",
    "enum",
    "fn",
    "macro_rules",
    "static",
    "struct",
    "trait",
    "type",
];

/// A module's own text.
#[derive(Debug, Default)]
pub struct Source {
    /// Names that it defines.
    pub items: BTreeSet<String>,
    /// Child modules; those in files of their own without their text.
    pub modules: Vec<(String, Option<Source>)>,
    /// Its `use` items, those inside functions too, with trees expanded.
    pub imports: Vec<Import>,
    /// Paths of two names or more outside of `use` items.
    pub paths: BTreeSet<Vec<String>>,
    /// All names outside of `use` and `mod` items and attributes.
    pub words: BTreeSet<String>,
}

/// One name that a `use` item brings in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Import {
    /// The path, without the `*` of a glob.
    pub path: Vec<String>,
    /// What it is called here; none for a glob.
    pub name: Option<String>,
    /// Whether it is handed on (`pub`, `pub(crate)` and so on).
    pub is_public: bool,
}

impl Source {
    /// Reads a file's text.
    ///
    /// # Errors
    /// If it does not consist of Rust's tokens.
    pub fn read(text: &str) -> anyhow::Result<Self> {
        let tokens: TokenStream = text.parse().map_err(|error| anyhow!("{error}"))?;
        Ok(Self::of(tokens))
    }

    /// Whether it only declares modules and hands on names.
    pub fn is_face(&self) -> bool {
        let inline = self
            .modules
            .iter()
            .filter_map(|(_, source)| source.as_ref());
        self.words.is_empty() && inline.into_iter().all(Self::is_face)
    }

    fn of(tokens: TokenStream) -> Self {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut source = Self::default();
        let mut rest = tokens.as_slice();
        let mut is_public = false;
        while let [first, after @ ..] = rest {
            (rest, is_public) = match word(first).as_deref() {
                Some("pub") => (without_scope(after), true),
                Some("use") => (source.take_import(after, is_public), false),
                Some("mod") => (source.take_module(after), false),
                Some(keyword) if DECLARATIONS.contains(&keyword) => {
                    source.take_declaration(after);
                    (source.take_text(rest), false)
                }
                None if is_punct(first, '#') => (source.take_attribute(after), is_public),
                _ => (source.take_text(rest), false),
            };
        }
        source
    }

    /// Notes the name that is declared; modifiers (`const fn`, `static mut`) are no names.
    fn take_declaration(&mut self, after: &[TokenTree]) {
        let names = after.iter().filter(|token| !is_punct(token, '!'));
        let name = names.map(word).next().flatten();
        if let Some(name) =
            name.filter(|name| !["fn", "mut", "unsafe", "_"].contains(&name.as_str()))
        {
            self.items.insert(name);
        } else if let Some(name) = after.get(1).and_then(word) {
            self.items.insert(name);
        }
    }

    /// A declaration or definition of a module; what follows it.
    fn take_module<'a>(&mut self, after: &'a [TokenTree]) -> &'a [TokenTree] {
        let [name, body, rest @ ..] = after else {
            return &[];
        };
        let inline = match body {
            TokenTree::Group(group) => Some(Self::of(group.stream())),
            _ => None,
        };
        self.modules.push((name.to_string(), inline));
        rest
    }

    /// A `use` item after its keyword; what follows it.
    fn take_import<'a>(&mut self, after: &'a [TokenTree], is_public: bool) -> &'a [TokenTree] {
        // A bound such as `impl Fn() + use<'a>` imports nothing.
        if after.first().is_none_or(|token| is_punct(token, '<')) {
            return after;
        }
        let end = position(after, |token| is_punct(token, ';'));
        expand(&[], &after[..end], is_public, &mut self.imports);
        after.get(end + 1..).unwrap_or_default()
    }

    /// An attribute after its `#`; what follows it, or the item that it keeps for tests.
    fn take_attribute<'a>(&mut self, after: &'a [TokenTree]) -> &'a [TokenTree] {
        let rest = match after {
            [inner, rest @ ..] if is_punct(inner, '!') => rest,
            all => all,
        };
        let [TokenTree::Group(group), rest @ ..] = rest else {
            return rest;
        };
        if is_for_tests(group) {
            return without_item(rest);
        }
        let mut text = Self::default();
        text.take_all(group.stream());
        self.paths.append(&mut text.paths);
        rest
    }

    /// A path, a name, or all that is inside brackets; what follows.
    fn take_text<'a>(&mut self, tokens: &'a [TokenTree]) -> &'a [TokenTree] {
        let [first, after @ ..] = tokens else {
            return &[];
        };
        if let TokenTree::Group(group) = first {
            self.take_all(group.stream());
            return after;
        }
        let Some(name) = word(first) else {
            if !is_punct(first, ';') {
                self.words.insert(first.to_string());
            }
            return after;
        };
        let (mut path, mut rest) = (vec![name], after);
        while let [a, b, next, more @ ..] = rest {
            let Some(name) = word(next).filter(|_| is_punct(a, ':') && is_punct(b, ':')) else {
                break;
            };
            path.push(name);
            rest = more;
        }
        self.words.extend(path.iter().cloned());
        if path.len() > 1 {
            self.paths.insert(path);
        }
        rest
    }

    /// The inside of a function, a type or a macro.
    fn take_all(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut rest = tokens.as_slice();
        while let [first, after @ ..] = rest {
            rest = match word(first).as_deref() {
                Some("use") => self.take_import(after, false),
                _ => self.take_text(rest),
            };
        }
    }
}

fn word(token: &TokenTree) -> Option<String> {
    match token {
        TokenTree::Ident(name) => Some(name.to_string()),
        _ => None,
    }
}

fn is_punct(token: &TokenTree, sign: char) -> bool {
    matches!(token, TokenTree::Punct(punct) if punct.as_char() == sign)
}

fn is_group(token: &TokenTree, delimiter: Delimiter) -> bool {
    matches!(token, TokenTree::Group(group) if group.delimiter() == delimiter)
}

/// Index of the first such token, or the end.
fn position(tokens: &[TokenTree], is_it: impl Fn(&TokenTree) -> bool) -> usize {
    tokens.iter().position(is_it).unwrap_or(tokens.len())
}

/// What follows `pub`, without `(crate)` and the like.
fn without_scope(tokens: &[TokenTree]) -> &[TokenTree] {
    match tokens {
        [scope, rest @ ..] if is_group(scope, Delimiter::Parenthesis) => rest,
        all => all,
    }
}

/// Whether an attribute is `cfg(test)` or a `cfg(all(test, …))`.
fn is_for_tests(attribute: &Group) -> bool {
    let text = attribute.stream().to_string();
    let is_word = |wanted: &str| {
        let mut words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        words.any(|word| word == wanted)
    };
    text.starts_with("cfg") && !text.starts_with("cfg_attr") && is_word("test") && !is_word("not")
}

/// What follows an item and its further attributes.
fn without_item(tokens: &[TokenTree]) -> &[TokenTree] {
    let mut rest = tokens;
    while let [sign, TokenTree::Group(_), after @ ..] = rest
        && is_punct(sign, '#')
    {
        rest = after;
    }
    let is_import = |tokens: &[TokenTree]| tokens.first().and_then(word).as_deref() == Some("use");
    let visible = match rest.first().and_then(word).as_deref() {
        Some("pub") => without_scope(&rest[1..]),
        _ => rest,
    };
    let ends_with_brace = !is_import(visible);
    let end = position(visible, |token| {
        is_punct(token, ';') || ends_with_brace && is_group(token, Delimiter::Brace)
    });
    visible.get(end + 1..).unwrap_or_default()
}

/// Every name of a `use` tree.
fn expand(before: &[String], tree: &[TokenTree], is_public: bool, to: &mut Vec<Import>) {
    let mut path = before.to_vec();
    let mut rest = tree;
    while let [first, after @ ..] = rest {
        rest = after;
        match first {
            TokenTree::Ident(name) if name == "as" => break,
            TokenTree::Ident(name) => path.push(name.to_string()),
            TokenTree::Group(group) => {
                let tokens: Vec<TokenTree> = group.stream().into_iter().collect();
                for tree in tokens.split(|token| is_punct(token, ',')) {
                    expand(&path, tree, is_public, to);
                }
                return;
            }
            star if is_punct(star, '*') => {
                let name = None;
                return to.push(Import {
                    path,
                    name,
                    is_public,
                });
            }
            _ => {}
        }
    }
    if path.len() == before.len() {
        return; // after a last comma
    }
    // `a::{self}` is `a`.
    if path.len() > 1 && path.last().is_some_and(|name| name == "self") {
        path.pop();
    }
    let name = rest.first().and_then(word).or_else(|| path.last().cloned());
    to.push(Import {
        path,
        name,
        is_public,
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `path as name` of every import, with `pub` before those that are handed on.
    fn imports(text: &str) -> Vec<String> {
        let source = Source::read(text).unwrap();
        let shown = |import: &Import| {
            let name = import.name.clone().unwrap_or("*".to_owned());
            let public = if import.is_public { "pub " } else { "" };
            format!("{public}{} as {name}", import.path.join("::"))
        };
        source.imports.iter().map(shown).collect()
    }

    #[test]
    fn trees_of_names_are_expanded() {
        let text = "use a::{self, b::{C, D as E}, f::*,};\npub(crate) use g::H;\nuse i;";
        let expected = [
            "a as a",
            "a::b::C as C",
            "a::b::D as E",
            "a::f as *",
            "pub g::H as H",
            "i as i",
        ];
        assert_eq!(imports(text), expected);
    }

    #[test]
    fn what_is_for_tests_alone_is_left_out() {
        let text = "#[cfg(test)] use a::{b};\n#[cfg(test)]\n#[path = \"x.rs\"]\nmod tests { use c::d; }\n\
                    #[cfg(not(test))] use e::f;\n#[cfg(test)]\npub(crate) fn g() -> crate::H { h::i() }\nuse j::k;";
        let source = Source::read(text).unwrap();
        assert_eq!(imports(text), ["e::f as f", "j::k as k"]);
        assert!(source.modules.is_empty() && source.paths.is_empty() && source.is_face());
    }

    #[test]
    fn paths_are_found_inside_functions_and_macros_but_not_in_comments_and_strings() {
        let text = "/// See [`crate::a::A`].\nfn f<'a>() -> impl Fn() + use<'a> {\n// crate::b::B\nuse c::d;\n\
                    assert!(crate::e::f('\\'') == \"crate::g::h\", super::i::<u8>()) }";
        let source = Source::read(text).unwrap();
        let paths: Vec<String> = source.paths.iter().map(|path| path.join("::")).collect();
        assert_eq!(paths, ["crate::e::f", "super::i"]);
        assert_eq!(imports(text), ["c::d as d"]);
    }

    #[test]
    fn declared_names_and_modules_are_known() {
        let text = "pub const fn a() {}\npub const B: u8 = 0;\nstatic C: u8 = 0;\npub struct D(pub u8);\nenum E {}\n\
                    trait F { fn g(&self); }\ntype H = u8;\nmacro_rules! i { () => {} }\nmod j;\nmod k { fn l() {} }";
        let source = Source::read(text).unwrap();
        let items: Vec<&str> = source.items.iter().map(String::as_str).collect();
        assert_eq!(items, ["B", "C", "D", "E", "F", "H", "a", "i"]);
        let modules: Vec<_> = source
            .modules
            .iter()
            .map(|m| (m.0.as_str(), m.1.is_some()))
            .collect();
        assert_eq!(modules, [("j", false), ("k", true)]);
        assert!(!source.is_face());
    }

    #[test]
    fn a_face_declares_and_hands_on() {
        let face = "#![doc = include_str!(\"a.md\")]\n//! Docs.\nmod a;\npub use a::B;\n#[cfg(unix)] pub(crate) use a::C;";
        assert!(Source::read(face).unwrap().is_face());
        for code in ["impl A {}", "pub const A: u8 = 0;", "mod a { fn b() {} }"] {
            assert!(
                !Source::read(&format!("{face}{code}")).unwrap().is_face(),
                "{code}"
            );
        }
    }
}
