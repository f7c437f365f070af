//! The report as one HTML file: pictures, fonts and style inside, no script, nothing to load.

use std::collections::BTreeMap;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use pulldown_cmark::{Event, Options, Parser};

use super::agreement::Agreement;
use super::finding;
use super::markdown;
use super::page::{Block, Page};
use super::text_table::TextTable;
use crate::figure::picture::{FONTS, without_fonts};

/// How the page looks on screen and on paper.
const STYLE: &str = include_str!("html.css");

/// The page as text; `svg` finds the text of a picture's SVG file by its name.
pub fn write<'a>(page: &Page, svg: impl Fn(&str) -> Option<&'a str>) -> String {
    let anchors = anchors(page.blocks());
    let blocks = page.blocks().iter().zip(&anchors);
    let blocks = blocks.map(|(block, anchor)| of_block(anchor, block, &svg));
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (page.title()) }
                link rel="icon" href="data:,";
                style { (PreEscaped(FONTS)) (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (page.title()) }
                    (contents(page.blocks(), &anchors))
                    @for block in blocks { (block) }
                }
            }
        }
    };
    page.into_string()
}

/// The parts and, below each, its sections, as links.
fn contents(blocks: &[Block], anchors: &[String]) -> Markup {
    let mut parts: Vec<(Markup, Vec<Markup>)> = Vec::new();
    for (block, anchor) in blocks.iter().zip(anchors) {
        let link = |title: &str| html! { a href=(format!("#{anchor}")) { (title) } };
        match (block, parts.last_mut()) {
            (Block::Part(title), _) => parts.push((link(title), Vec::new())),
            (Block::Section(title), Some((_, sections))) => sections.push(link(title)),
            _ => {}
        }
    }
    html! {
        nav {
            h2 { "Contents" }
            ol {
                @for (part, sections) in parts {
                    li {
                        (part)
                        @if !sections.is_empty() {
                            ul { @for section in sections { li { (section) } } }
                        }
                    }
                }
            }
        }
    }
}

/// Names of the headings, from their words; those that come again get a number. Other blocks have none.
fn anchors(blocks: &[Block]) -> Vec<String> {
    let mut uses: BTreeMap<String, usize> = BTreeMap::new();
    let anchor = |block: &Block| {
        let (Block::Part(title) | Block::Section(title)) = block else {
            return String::new();
        };
        let lower = title.to_lowercase();
        let words = lower.split(|c: char| !c.is_alphanumeric());
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        let name = words.join("-");
        let n_uses = uses.entry(name.clone()).or_default();
        *n_uses += 1;
        match *n_uses {
            1 => name,
            n => format!("{name}-{n}"),
        }
    };
    blocks.iter().map(anchor).collect()
}

fn of_block<'a>(anchor: &str, block: &Block, svg: &impl Fn(&str) -> Option<&'a str>) -> Markup {
    match block {
        Block::Part(title) => html! { h2 id=(anchor) { (title) } },
        Block::Section(title) => html! { h3 id=(anchor) { (title) } },
        Block::Prose(text) => rendered(text),
        Block::List(items) => rendered(&markdown::list(items)),
        Block::Table(table) => of_table(table, None, |_, _| None),
        Block::Compared(table) => compared(table),
        Block::Claims(claims) => {
            of_table(&finding::side_by_side(claims), Some("claims"), |_, _| None)
        }
        Block::Picture { caption, png } => picture(caption, png, svg),
        Block::Command(command) => html! { pre { code { (command) } } },
        Block::Rows { file, key } => {
            html! { div class="rows" { (rendered(&markdown::rows(file, key))) } }
        }
    }
}

/// Markdown as HTML; tags in the text are shown as they are written.
fn rendered(text: &str) -> Markup {
    let as_text = |event| match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    };
    let events = Parser::new_ext(text, Options::ENABLE_TABLES).map(as_text);
    let mut out = String::new();
    pulldown_cmark::html::push_html(&mut out, events);
    let out = out.replace("<table>", "<div class=\"scroll\"><table>");
    PreEscaped(out.replace("</table>", "</table></div>"))
}

/// A table; `class` gives an entry of a column a class of its own.
fn of_table(
    table: &TextTable,
    table_class: Option<&str>,
    class: impl Fn(usize, &str) -> Option<&'static str>,
) -> Markup {
    let alignment = |column| (column >= table.n_left).then_some("number");
    let classes = |column, entry: &str| {
        // A browser would break 2.6e-2 after its minus sign.
        let unbroken = (!entry.contains(' ')).then_some("word");
        let all = [alignment(column), unbroken, class(column, entry)];
        let all: Vec<&str> = all.into_iter().flatten().collect();
        (!all.is_empty()).then(|| all.join(" "))
    };
    html! {
        div class="scroll" {
            table class=[table_class] {
                thead {
                    tr {
                        @for (column, title) in table.header.iter().enumerate() {
                            th class=[alignment(column)] { (title) }
                        }
                    }
                }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (column, entry) in row.iter().enumerate() {
                                td class=[classes(column, entry)] { (entry) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// A table whose ratios are coloured, with the colours' meaning.
fn compared(table: &TextTable) -> Markup {
    let of_ratio = |column: usize, entry: &str| {
        let is_ratio = table
            .header
            .get(column)
            .is_some_and(|title| title == "ratio");
        let ratio: f64 = entry.parse().ok().filter(|_| is_ratio)?;
        Some(class_of(Agreement::of(ratio)))
    };
    html! {
        (of_table(table, None, of_ratio))
        p class="legend" {
            "ratio = ours / published. "
            @for agreement in Agreement::ALL {
                span class=(class_of(agreement)) { (agreement.range()) ": " (agreement.meaning()) }
            }
        }
    }
}

fn class_of(agreement: Agreement) -> &'static str {
    match agreement {
        Agreement::Lower => "lower",
        Agreement::Same => "same",
        Agreement::Higher => "higher",
        Agreement::FarHigher => "far-higher",
    }
}

/// The SVG picture inside the page, or a link to the PNG file where there is none.
fn picture<'a>(caption: &str, png: &str, svg: &impl Fn(&str) -> Option<&'a str>) -> Markup {
    let stem = png.strip_suffix(".png").unwrap_or(png);
    let drawing = svg(&format!("{stem}.svg")).map(|text| inlined(text, stem));
    html! {
        figure {
            @match drawing {
                Some(drawing) => (PreEscaped(drawing)),
                None => img src=(png) alt=(caption);,
            }
            figcaption { (caption) }
        }
    }
}

/// An SVG file's text for the inside of a page: the page has the fonts, and names begin with `stem`.
fn inlined(svg: &str, stem: &str) -> String {
    let mut text = without_fonts(svg);
    for name in names(&text) {
        for (before, after) in [("id=\"", "\""), ("url(#", ")"), ("href=\"#", "\"")] {
            let own = format!("{before}{stem}-{name}{after}");
            text = text.replace(&format!("{before}{name}{after}"), &own);
        }
    }
    text.replacen("<svg ", "<svg role=\"img\" ", 1)
}

/// The names that parts of an SVG text have.
fn names(svg: &str) -> Vec<String> {
    let after = svg.split(" id=\"").skip(1);
    let names = after.filter_map(|rest| rest.split('"').next());
    names.map(str::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_markdown_rendered() {
        let mut page = Page::titled("a < b");
        page.prose("`x` and <script>y</script>.");
        page.list(&["one:\n    - nested".into()], "");
        let text = write(&page, |_| None);
        assert!(text.contains("<h1>a &lt; b</h1>"), "{text}");
        assert!(text.contains("<code>x</code> and &lt;script&gt;"), "{text}");
        assert_eq!(text.matches("<ul>").count(), 2, "{text}");
        assert!(!text.contains("<script"), "{text}");
    }

    #[test]
    fn ratios_are_coloured_and_other_columns_are_not() {
        let mut page = Page::titled("T");
        let rows = [["a", "0.1", "0.1"], ["b", "9", "–"], ["c", "9", "1.0e2"]];
        let rows = rows.map(|row| row.map(String::from).to_vec());
        page.compared(&TextTable::new(1, ["model", "n = 20", "ratio"], rows));
        let text = write(&page, |_| None);
        assert_eq!(
            text.matches("class=\"number word lower\"").count(),
            1,
            "{text}"
        );
        assert_eq!(text.matches("class=\"number word far-higher\"").count(), 1);
        assert!(text.contains("<td class=\"number word\">–</td>"), "{text}");
    }

    #[test]
    fn names_in_pictures_do_not_clash_and_the_fonts_come_once() {
        let mut drawing = crate::figure::picture::Picture::new(10.0, 10.0);
        drawing.rectangle((0.0, 0.0, 1.0, 1.0), "none", None);
        let drawing = drawing.to_svg();
        let clipped = "<g><clipPath id=\"c0\"/><path clip-path=\"url(#c0)\"/></g></svg>";
        let svg = drawing.replace("</svg>", clipped);
        let mut page = Page::titled("T");
        page.picture("one", "fig02.png");
        page.picture("two", "fig03.png");
        let text = write(&page, |name| {
            ["fig02.svg", "fig03.svg"]
                .contains(&name)
                .then_some(svg.as_str())
        });
        for own in ["id=\"fig02-c0\"", "url(#fig02-c0)", "url(#fig03-c0)"] {
            assert_eq!(text.matches(own).count(), 1, "{own}: {text}");
        }
        // Regular and bold.
        assert_eq!(text.matches("@font-face").count(), 2);
        assert!(!text.contains("fig02.png"));
    }

    #[test]
    fn the_contents_link_to_every_heading() {
        let mut page = Page::titled("T");
        page.part("Section 3.4: LR¬c");
        page.section("Fits");
        page.section("Fits");
        let text = write(&page, |_| None);
        for name in ["section-3-4-lr-c", "fits", "fits-2"] {
            for use_of in [format!("href=\"#{name}\""), format!("id=\"{name}\"")] {
                assert_eq!(text.matches(&use_of).count(), 1, "{use_of}: {text}");
            }
        }
    }
}
