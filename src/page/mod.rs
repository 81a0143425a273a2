//! What all pages that the program writes share: style, the first pieces of their scripts, data that can stand within HTML, templates.
//! A page is one file that fetches nothing.

use minijinja::{AutoEscape, Environment, Value, context};
use serde::Serialize;

use crate::{Error, Result};

/// Around the body of every page.
const FRAME: &str = include_str!("frame.html");

/// Light and dark, phone and paper: everything but what only one page has.
pub const STYLE: &str = include_str!("style.css");

/// `data` (the JSON of the element of that id), elements, numbers as words, tables. A page's own scripts follow in the same scope.
const SCRIPT: &str = concat!(include_str!("dom.js"), include_str!("tables.js"));

/// A page to be.
pub struct Page<'a> {
    /// What the browser's tab says.
    pub title: &'a str,
    /// Template of what the reader sees; whatever is put into it is escaped unless it is [`safe`]. Its filter `places(n)` shows that many
    /// of a number.
    pub body: &'a str,
    /// Style that only this page has.
    pub style: &'a str,
    /// Scripts that only this page has, and the data that they draw from ([`json`]).
    pub script: Option<(&'a str, &'a str)>,
}

impl Page<'_> {
    /// The page, its body filled in from `context`.
    ///
    /// # Errors
    /// [`Error::Internal`] for a template that is none.
    pub fn render(&self, context: Value) -> Result<String> {
        let body = safe(render(self.body, context)?);
        let style = safe([STYLE, self.style].concat());
        let (script, data) = self.script.map(|(script, data)| (safe([SCRIPT, script].concat()), safe(data))).unzip();
        render(FRAME, context! { title => self.title, style, body, script, data })
    }
}

/// Data as JSON that can stand within HTML: no `<` ends the element that it stands in.
///
/// # Errors
/// [`Error::Internal`] for what JSON cannot hold.
pub fn json(data: &impl Serialize) -> Result<String> {
    // Outside of strings JSON has no `<`.
    serde_json::to_string(data).map(|json| json.replace('<', "\\u003c")).map_err(internal)
}

/// A template filled in.
fn render(template: &str, context: Value) -> Result<String> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_filter("places", |value: f64, places: usize| format!("{value:.places$}"));
    environment.render_str(template, context).map_err(internal)
}

/// Text that goes into a template as it is.
pub fn safe(text: impl Into<String>) -> Value {
    Value::from_safe_string(text.into())
}

/// 1234567 as 1,234,567.
pub fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    groups.join(",")
}

fn internal(cause: impl std::fmt::Display) -> Error {
    Error::Internal { stage: "page", what: cause.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_leaves_its_place() {
        let evil = "</script><img src=x>";
        assert!(!json(&evil).unwrap().contains('<'));
        assert_eq!(serde_json::from_str::<String>(&json(&evil).unwrap()).unwrap(), evil);
        let body = "{{ a }} {{ b }}";
        let page = Page { title: evil, body, style: "", script: None }.render(context! { a => evil, b => safe("<b>") }).unwrap();
        assert!(!page.contains("<img") && page.contains(" <b>\n") && !page.contains("<script"), "{page}");
        let data = json(&evil).unwrap();
        let page = Page { title: "", body, style: "p { }", script: Some(("start();", &data)) }.render(context! {}).unwrap();
        assert!(page.contains("p { }</style>") && page.contains("start();</script>") && page.contains(&data), "{page}");
        assert_eq!(page.matches("<script").count(), 2);
    }
}
