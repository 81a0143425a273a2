//! Curves as SVG whose colours are the page's, light and dark.

use std::fmt::Write as _;

use serde::Serialize;

/// One curve.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Curve {
    /// What it is.
    pub name: String,
    /// Its points, from left to right.
    pub points: Vec<[f64; 2]>,
}

/// Some curves on common axes that begin at 0.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What is told along, and what up.
    pub axes: [String; 2],
    /// Its curves, six at most.
    pub curves: Vec<Curve>,
}

/// Columns and rows of the drawing, and where its axes are: left, right, top, bottom.
const SIZE: [f64; 2] = [520.0, 300.0];
const INSIDE: [f64; 4] = [52.0, 508.0, 12.0, 256.0];
/// Of six colours of the page, those without a second meaning.
const COLORS: usize = 6;

impl Chart {
    /// As SVG; its names are the caller's own words and need no escaping.
    pub fn svg(&self) -> String {
        let [left, right, top, bottom] = INSIDE;
        let most = |axis: usize| round_up(self.curves.iter().flat_map(|c| &c.points).map(|p| p[axis]).fold(0.0, f64::max));
        let (across, up) = (most(0), most(1));
        let place = |[x, y]: [f64; 2]| [left + (right - left) * x / across, bottom - (bottom - top) * y / up];
        let mut svg = format!("<svg viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">", SIZE[0], SIZE[1], self.title);
        for step in 0..=4 {
            let (x, y) = (across * f64::from(step) / 4.0, up * f64::from(step) / 4.0);
            let ([px, _], [_, py]) = (place([x, 0.0]), place([0.0, y]));
            let _ = write!(
                svg,
                "<path class=\"axis\" d=\"M{left} {py:.1}H{right}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 6.0,
                py + 4.0,
                short(y)
            );
            let _ = write!(svg, "<text x=\"{px:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", bottom + 16.0, short(x));
        }
        let [along, upward] = &self.axes;
        let _ = write!(svg, "<text x=\"{right}\" y=\"{}\" text-anchor=\"end\">{along}</text>", bottom + 36.0);
        let _ = write!(svg, "<text x=\"{left}\" y=\"{}\">{upward}</text>", bottom + 36.0);
        for (number, curve) in self.curves.iter().enumerate() {
            let points: Vec<String> = curve.points.iter().map(|p| place(*p)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            let color = number % COLORS;
            let _ = write!(
                svg,
                "<polyline fill=\"none\" stroke=\"var(--c{color})\" stroke-width=\"2.5\" points=\"{}\"/>",
                points.join(" ")
            );
        }
        svg + "</svg>"
    }
}

/// The least of 1, 2, 4, 5, 8 times a power of ten that is not below `most`.
fn round_up(most: f64) -> f64 {
    if !(most > 0.0 && most.is_finite()) {
        return 1.0;
    }
    let power = 10f64.powf(most.log10().floor());
    [1.0, 2.0, 4.0, 5.0, 8.0, 10.0].into_iter().map(|n| n * power).find(|n| *n >= most * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}
