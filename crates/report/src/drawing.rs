//! A drawing that stands alone, as SVG or in a page of its own.

use crate::svg::escape;

/// The colours of every drawing, in the light and in the dark.
pub(crate) const STYLE: &str = include_str!("drawing.css");

/// A finished drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// What it shows.
    pub title: String,
    /// One `<svg>` element without its style.
    pub(crate) element: String,
}

impl Drawing {
    /// The file of an SVG drawing, style included.
    pub fn svg(&self) -> String {
        let head = r#"<svg xmlns="http://www.w3.org/2000/svg" "#;
        let body = self.element.replacen("<svg ", head, 1);
        // A drawing without a page has its own ground.
        let ground = r#"<rect width="100%" height="100%" fill="var(--card)"/>"#;
        let style = STYLE.replace('&', "&amp;").replace('<', "&lt;");
        body.replacen('>', &format!("><style>{style}</style>{ground}"), 1) + "\n"
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
