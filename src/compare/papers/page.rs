//! The page of exhibits: `papers.html`, which needs no script and nothing but itself and the pictures beside it, and `papers.json`.

use std::path::PathBuf;

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;

use crate::model::About;
use crate::page::{Page, safe};
use crate::{Error, Result, files};

use super::{Bench, Chart, Request, Shown};

const BODY: &str = include_str!("papers.html");
/// What only this page has.
const STYLE: &str = include_str!("papers.css");

/// What `papers.json` holds.
#[derive(Serialize)]
struct Data<'a> {
    program: String,
    source: &'a str,
    seed: u64,
    adapter: String,
    command: &'a str,
    exhibits: &'a [Shown],
}

/// Writes both; gives where the page is.
pub(super) fn write(bench: &Bench, request: &Request, exhibits: &[Shown]) -> Result<PathBuf> {
    let info = &bench.renderer.gpu.info;
    let adapter = format!("{}, {} {}", info.name, info.driver, info.driver_info);
    let (program, source) = (About::this_program(), bench.source().name());
    let data = Data { program, source, seed: request.seed.0, adapter, command: request.command, exhibits };
    let page = request.folder.join("papers.html");
    let json = serde_json::to_string_pretty(&data).map_err(internal)?;
    files::write_all(&[(request.folder.join("papers.json"), json.into_bytes()), (page.clone(), html(&data)?.into_bytes())])?;
    Ok(page)
}

fn html(data: &Data) -> Result<String> {
    let drawing = |chart: &Chart| context! { chart => Value::from(Serde(chart)), svg => safe(chart.svg()) };
    let charts = |shown: &Shown| -> Vec<Value> { shown.ours.charts.iter().map(drawing).collect() };
    let drawn: Vec<Vec<Value>> = data.exhibits.iter().map(charts).collect();
    let title = format!("{}: the papers redrawn", data.source);
    let data = Value::from(Serde(data));
    Page { title: &title, body: BODY, style: STYLE, script: None }.render(context! { data, drawn })
}

fn internal(cause: impl std::fmt::Display) -> Error {
    Error::Internal { stage: "compare::papers", what: cause.to_string() }
}
