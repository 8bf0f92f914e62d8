//! A drawing that stands alone, as SVG or in a page of its own.

use crate::svg::escape;

/// The colours of every drawing, in the light and in the dark.
pub(crate) const STYLE: &str = include_str!("drawing.css");

// What keeps letters readable over lines. Where `paint-order` is not known it would paint over the letters instead.
const HALO: &str = " paint-order: stroke; stroke: var(--card); stroke-width: 3px;";

/// A finished drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// What it shows.
    pub title: String,
    /// One `<svg>` element without its style.
    pub(crate) element: String,
}

impl Drawing {
    /// The file of an SVG drawing, style included, in the light. Its colours are plain ones: programs that draw SVG without
    /// being a browser know no variables and would make everything black.
    pub fn svg(&self) -> String {
        let head = r#"<svg xmlns="http://www.w3.org/2000/svg" "#;
        let body = self.element.replacen("<svg ", head, 1);
        // A drawing without a page has its own ground.
        let ground = r#"<rect width="100%" height="100%" fill="var(--card)"/>"#;
        let (colours, rules) = light();
        let style = rules.replace(HALO, "").replace('&', "&amp;").replace('<', "&lt;");
        let whole = body.replacen('>', &format!("><style>{style}</style>{ground}"), 1) + "\n";
        colours.iter().fold(whole, |text, (name, colour)| text.replace(&format!("var({name})"), colour))
    }

    /// A page with the drawing on it; no script, no network.
    pub fn html(&self) -> String {
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>{}</title>\n<style>\n{STYLE}body {{ margin: 24px auto; max-width: 960px; background: var(--card); }}\nsvg {{ width: 100%; height: auto; }}\n</style>\n</head>\n<body>\n{}\n</body>\n</html>\n",
            escape(&self.title),
            self.element
        )
    }
}

// The light colours by the names of their variables, and the rules that use them.
fn light() -> (Vec<(&'static str, &'static str)>, &'static str) {
    let (root, rest) = STYLE.split_once('}').unwrap_or(("", STYLE));
    let named = root.split_once('{').map_or("", |(_, colours)| colours);
    let colours = named.split(';').filter_map(|c| c.split_once(':')).map(|(n, c)| (n.trim(), c.trim()));
    // The dark follows, in a block of its own.
    let rules = rest.split_once("\n}\n").map_or(rest, |(_, rules)| rules);
    (colours.collect(), rules)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_plain_colours_and_a_page_both_sets() {
        let element = r#"<svg viewBox="0 0 1 1"><path stroke="var(--grid)"/></svg>"#.to_owned();
        let drawing = Drawing { title: "t".into(), element };
        let file = drawing.svg();
        assert!(!file.contains("var(") && !file.contains("--") && !file.contains("@media"), "{file}");
        assert!(file.contains("fill=\"#ffffff\"") && file.contains("stroke=\"#e9ebee\""), "{file}");
        assert!(file.contains("svg text { fill: #1c1f24; font"), "{file}");
        assert!(file.contains("svg .curve.before { stroke: #c2540a; }"), "{file}");
        let page = drawing.html();
        assert!(page.contains("var(--ink)") && page.contains("prefers-color-scheme: dark"));
    }
}
