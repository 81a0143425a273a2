//! Plots as SVG files: what a frame of a drive costs along its path, and what benchmarks find. Each is drawn once, as a file that any
//! program shows; a page embeds the same drawing with its own colours in place of the file's.

use plotters::coord::Shift;
use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use crate::{Error, Result};

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Drawn {
    /// The area between it and those before it, on which it stands.
    Area,
    /// A line, with a dot at each point where there are few; a single point has its name beside it.
    Line,
    /// A thin line in the colour of words: what the others come to.
    Total,
    /// A dashed line: what was asked for.
    Limit,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// What it is.
    pub name: String,
    /// How it is drawn.
    pub drawn: Drawn,
    /// Its points, from left to right; areas share theirs.
    pub points: Vec<[f64; 2]>,
}

impl Curve {
    /// A curve of that name.
    pub fn new(name: impl Into<String>, drawn: Drawn, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), drawn, points }
    }
}

/// Curves on common axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// What is told along, and what up.
    pub axes: [String; 2],
    /// Whether each axis is logarithmic; then what is not above 0 is left out.
    pub logarithmic: [bool; 2],
    /// Its curves.
    pub curves: Vec<Curve>,
}

/// A chart that was drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// A whole SVG file.
    pub svg: String,
    /// Left, right, upper and lower end of the axes, of the width and height of the drawing.
    pub inside: [f64; 4],
    /// The values there.
    pub along: [f64; 2],
}

/// Places are whole numbers of this share of a unit of the drawing.
const FINE: u32 = 4;
/// Height of the letters of a dot's name.
const NAME: i32 = 13;
/// Columns and rows of a drawing.
const SIZE: [u32; 2] = [760, 380];
/// The page's colours, light, by the names of its style.
const COLORS: [(&str, RGBColor); 11] = [
    ("c0", RGBColor(0x2a, 0x6a, 0x3c)),
    ("c1", RGBColor(0xc0, 0x4a, 0x00)),
    ("c2", RGBColor(0x0b, 0x66, 0xb0)),
    ("c3", RGBColor(0xa6, 0x3a, 0x86)),
    ("c4", RGBColor(0x97, 0x72, 0x0a)),
    ("c5", RGBColor(0x0b, 0x80, 0x80)),
    ("rest", RGBColor(0xa3, 0xac, 0xa5)),
    ("ink", RGBColor(0x1d, 0x23, 0x1e)),
    ("soft", RGBColor(0x5a, 0x64, 0x5c)),
    ("line", RGBColor(0xd9, 0xde, 0xd7)),
    ("paper", RGBColor(0xfb, 0xfb, 0xf8)),
];
/// Colours of curves. Lines after them have the same again, in dashes; areas are all `rest`.
const OWN: usize = 6;
const REST: usize = 6;
/// Dashes and gaps of lines: the first six have none.
const DASHES: [[i32; 2]; 3] = [[1, 0], [9, 5], [2, 5]];
const INK: RGBColor = COLORS[7].1;
const SOFT: RGBColor = COLORS[8].1;
const LINE: RGBColor = COLORS[9].1;
const PAPER: RGBColor = COLORS[10].1;

impl Drawing {
    /// To be embedded in a page: its colours are the page's, light and dark.
    pub fn embedded(&self) -> String {
        let mut svg = self.svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1);
        for (name, RGBColor(r, g, b)) in COLORS {
            svg = svg.replace(&format!("\"#{r:02X}{g:02X}{b:02X}\""), &format!("\"var(--{name})\""));
        }
        svg
    }
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// Draws it.
    ///
    /// # Errors
    /// [`Error::Internal`] when the drawing fails.
    pub fn draw(&self) -> Result<Drawing> {
        let mut svg = String::new();
        let size = SIZE.map(|side| side * FINE);
        let [xs, ys] = [self.range(0), self.range(1)];
        let (x, y) = (xs[0]..xs[1], ys[0]..ys[1]);
        let root = SVGBackend::with_string(&mut svg, size.into()).into_drawing_area();
        root.fill(&PAPER).map_err(internal)?;
        let inside = match self.logarithmic {
            [false, false] => self.draw_on(&root, x, y),
            [true, false] => self.draw_on(&root, x.log_scale(), y),
            [false, true] => self.draw_on(&root, x, y.log_scale()),
            [true, true] => self.draw_on(&root, x.log_scale(), y.log_scale()),
        }?;
        root.present().map_err(internal)?;
        drop(root);
        let [width, height] = size;
        let own = format!("width=\"{width}\" height=\"{height}\"");
        let shown = format!("width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"{}\"", SIZE[0], SIZE[1], escaped(&self.title));
        Ok(Drawing { svg: svg.replacen(&own, &shown, 1), inside, along: xs })
    }

    /// Points that can be drawn, areas standing on those before them.
    fn points(&self, curve: usize) -> Vec<[f64; 2]> {
        let Curve { drawn, points, .. } = &self.curves[curve];
        let below = || self.curves[..curve].iter().filter(|other| other.drawn == Drawn::Area);
        let raised = |(i, &[x, y]): (usize, &[f64; 2])| match drawn {
            Drawn::Area => [x, y + below().filter_map(|other| other.points.get(i)).map(|point| point[1]).sum::<f64>()],
            _ => [x, y],
        };
        let fits = |point: &[f64; 2]| (0..2).all(|axis| point[axis].is_finite() && (point[axis] > 0.0 || !self.logarithmic[axis]));
        points.iter().enumerate().map(raised).filter(fits).collect()
    }

    /// Whether its curves are points, each with its name.
    fn is_scattered(&self) -> bool {
        self.curves.iter().all(|curve| curve.drawn == Drawn::Line && curve.points.len() == 1)
    }

    /// From where to where an axis goes.
    fn range(&self, axis: usize) -> [f64; 2] {
        let values = || (0..self.curves.len()).flat_map(|curve| self.points(curve)).map(move |point| point[axis]);
        let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        match (least.is_finite(), self.logarithmic[axis]) {
            (false, true) => [1.0, 10.0],
            (false, false) => [0.0, 1.0],
            // Wider than what is shown, and never empty.
            (true, true) => [least / 1.3, most * 1.3],
            // Names stand to the right of points.
            (true, false) if axis == 0 && self.is_scattered() => [least.min(0.0), if most > 0.0 { 1.25 * most } else { 1.0 }],
            (true, false) if axis == 0 && most > least => [least, most],
            (true, false) => [least.min(0.0), if most > 0.0 { 1.06 * most } else { 1.0 }],
        }
    }

    fn draw_on<X, Y>(&self, root: &Area, x: X, y: Y) -> Result<[f64; 4]>
    where
        X: AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
        Y: AsRangedCoord<Value = f64, CoordDescType: ValueFormatter<f64>>,
    {
        let fine = FINE as i32;
        let font = |size: i32, color: &'static RGBColor| ("system-ui, sans-serif", size * fine).into_font().color(color);
        root.draw(&Text::new(self.title.clone(), (10 * fine, 10 * fine), font(19, &INK))).map_err(internal)?;
        let top = self.draw_names(root, &font(16, &SOFT))?;
        let mut builder = ChartBuilder::on(root);
        builder.margin_top(top).margin_right(16 * fine).margin_bottom(6 * fine).margin_left(6 * fine);
        let mut chart =
            builder.x_label_area_size(40 * fine).y_label_area_size(64 * fine).build_cartesian_2d(x, y).map_err(internal)?;
        let short = |value: &f64| short(*value);
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(LINE.stroke_width(FINE))
            .axis_style(LINE.stroke_width(FINE))
            .x_labels(8)
            .y_labels(6)
            .x_label_formatter(&short)
            .y_label_formatter(&short)
            .label_style(font(15, &SOFT))
            .axis_desc_style(font(15, &SOFT))
            .x_desc(&self.axes[0])
            .y_desc(&self.axes[1])
            .draw()
            .map_err(internal)?;
        let areas = (0..self.curves.len()).rev().filter(|curve| self.curves[*curve].drawn == Drawn::Area);
        let lines = (0..self.curves.len()).filter(|curve| self.curves[*curve].drawn != Drawn::Area);
        for curve in areas.chain(lines) {
            let points: Vec<(f64, f64)> = self.points(curve).into_iter().map(|[x, y]| (x, y)).collect();
            let (Some(first), Some(last)) = (points.first().copied(), points.last().copied()) else { continue };
            let style = |width: u32| self.color(curve).stroke_width(width * FINE);
            match self.curves[curve].drawn {
                Drawn::Area => {
                    let outline = points.into_iter().chain([(last.0, 0.0), (first.0, 0.0)]).collect::<Vec<_>>();
                    chart.draw_series([Polygon::new(outline, self.color(curve).filled())]).map_err(internal)?;
                }
                Drawn::Line => {
                    if points.len() <= 40 {
                        let dots = points.iter().map(|at| Circle::new(*at, 3 * fine, self.color(curve).filled()));
                        chart.draw_series(dots).map_err(internal)?;
                    }
                    let [dash, gap] = self.dashes(curve).map(|length| length * fine);
                    if gap == 0 {
                        chart.draw_series(LineSeries::new(points, style(2))).map_err(internal)?;
                    } else {
                        chart.draw_series(DashedLineSeries::new(points, dash, gap, style(2))).map_err(internal)?;
                    }
                }
                Drawn::Total => _ = chart.draw_series(LineSeries::new(points, style(1))).map_err(internal)?,
                Drawn::Limit => {
                    let dashes = DashedLineSeries::new(points, 6 * fine, 5 * fine, style(1));
                    chart.draw_series(dashes).map_err(internal)?;
                }
            }
        }
        let alone = |curve: &usize| self.curves[*curve].drawn == Drawn::Line && self.points(*curve).len() == 1;
        let named: Vec<usize> = (0..self.curves.len()).filter(alone).collect();
        let at = |curve: &usize| chart.backend_coord(&self.points(*curve)[0].into());
        let dots: Vec<(i32, i32)> = named.iter().map(at).map(|(x, y)| (x / fine, y / fine)).collect();
        let names: Vec<&str> = named.iter().map(|curve| &*self.curves[*curve].name).collect();
        for (name, (x, y)) in names.iter().zip(places_of_names(&dots, &names)) {
            root.draw(&Text::new(name.to_string(), (x * fine, y * fine), font(NAME, &SOFT))).map_err(internal)?;
        }
        let (across, up) = chart.plotting_area().get_pixel_range();
        let share = |at: i32, side: usize| f64::from(at) / f64::from(SIZE[side] * FINE);
        Ok([share(across.start, 0), share(across.end, 0), share(up.start, 1), share(up.end, 1)])
    }

    /// What each curve is, in rows under the title; gives where the rest may begin.
    fn draw_names(&self, root: &Area, style: &TextStyle) -> Result<i32> {
        let fine = FINE as i32;
        let (mut x, mut y) = (10, 38);
        for (number, curve) in self.curves.iter().enumerate().filter(|_| !self.is_scattered()) {
            // As wide as letters are that are wider than most.
            let width = 36 + (curve.name.chars().count() as i32) * 8;
            if x > 10 && x + width > SIZE[0] as i32 - 10 {
                (x, y) = (10, y + 20);
            }
            let (dash, gap, high) = match curve.drawn {
                Drawn::Area => (18, 0, 10),
                Drawn::Line => (self.dashes(number)[0], self.dashes(number)[1], 3),
                Drawn::Total => (18, 0, 1),
                Drawn::Limit => (5, 4, 1),
            };
            let mut from = 0;
            while from < 18 {
                let to = if gap == 0 { 18 } else { (from + dash).min(18) };
                let corners = [(x + from, y + 6 - high / 2), (x + to, y + 6 - high / 2 + high)].map(|(x, y)| (x * fine, y * fine));
                root.draw(&Rectangle::new(corners, self.color(number).filled())).map_err(internal)?;
                from = to + gap.max(1);
            }
            root.draw(&Text::new(curve.name.clone(), ((x + 24) * fine, y * fine), style.clone())).map_err(internal)?;
            x += width;
        }
        Ok((y + 28) * fine)
    }

    /// Areas or lines before it.
    fn before(&self, curve: usize) -> usize {
        self.curves[..curve].iter().filter(|other| matches!(other.drawn, Drawn::Area | Drawn::Line)).count()
    }

    fn color(&self, curve: usize) -> RGBColor {
        match (self.curves[curve].drawn, self.before(curve)) {
            (Drawn::Total, _) => INK,
            (Drawn::Limit, _) => SOFT,
            (Drawn::Area, number) if number >= OWN => COLORS[REST].1,
            (_, number) => COLORS[number % OWN].1,
        }
    }

    fn dashes(&self, curve: usize) -> [i32; 2] {
        DASHES[(self.before(curve) / OWN).min(DASHES.len() - 1)]
    }
}

/// Top left corners of names beside their dots: right of them, or wherever else there is room nearest to that.
fn places_of_names(dots: &[(i32, i32)], names: &[&str]) -> Vec<(i32, i32)> {
    let meet = |a: [i32; 4], b: [i32; 4]| a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
    let mut taken: Vec<[i32; 4]> = dots.iter().map(|(x, y)| [x - 3, y - 3, x + 3, y + 3]).collect();
    let mut places = vec![];
    for ((x, y), name) in dots.iter().zip(names) {
        // As wide as letters are that are wider than most.
        let (width, height) = (name.chars().count() as i32 * NAME * 11 / 20, NAME);
        let beside = [x + 6, x - 6 - width].map(|left| (left, y - 6));
        let above_and_below = (1..8)
            .flat_map(|step| [-1, 1].map(|way| way * step * height / 2))
            .flat_map(|off| [x + 6, x - width / 2, x - 6 - width].map(|left| (left, y - 6 + off)));
        let bounds = |(left, top): (i32, i32)| [left, top, left + width, top + height];
        let is_free = |place: &(i32, i32)| {
            let [left, _, right, _] = bounds(*place);
            left >= 0 && right <= SIZE[0] as i32 && !taken.iter().any(|other| meet(bounds(*place), *other))
        };
        let place = beside.into_iter().chain(above_and_below).find(is_free).unwrap_or(beside[0]);
        taken.push(bounds(place));
        places.push(place);
    }
    places
}

/// A number on an axis: 1,200 as 1.2k.
fn short(value: f64) -> String {
    let (value, unit) = match value.abs() {
        size if size >= 1e6 => (value / 1e6, "M"),
        size if size >= 1e3 => (value / 1e3, "k"),
        _ => (value, ""),
    };
    let text = format!("{value:.3}");
    format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

fn internal(cause: impl std::fmt::Display) -> Error {
    Error::Internal { stage: "grove::plots", what: cause.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(curves: Vec<Curve>) -> Chart {
        Chart { title: "a <b> \"c\"".to_owned(), axes: ["along".to_owned(), "up".to_owned()], logarithmic: [false; 2], curves }
    }

    #[test]
    fn areas_stand_on_each_other() {
        let area = |name: &str, y: f64| Curve::new(name, Drawn::Area, vec![[0.0, y], [1.0, 2.0 * y]]);
        let chart = chart(vec![area("a", 1.0), Curve::new("all", Drawn::Total, vec![[0.0, 9.0]]), area("b", 3.0)]);
        assert_eq!(chart.points(2), [[0.0, 4.0], [1.0, 8.0]]);
        assert_eq!(chart.points(1), [[0.0, 9.0]]);
        assert_eq!(chart.range(0), [0.0, 1.0]);
    }

    #[test]
    fn names_of_dots_that_lie_together_do_not_cover_each_other() {
        let names = ["sphere-board", "grid-slices", "csg", "billboard", "octahedral", "lodf"];
        let dots: Vec<(i32, i32)> = (0..6).map(|i| (500 + 4 * i, 200 + 3 * (i % 2))).collect();
        let places = places_of_names(&dots, &names);
        assert_eq!(places_of_names(&[(500, 200)], &["csg"]), [(506, 194)], "to the right where nothing is in the way");
        let bounds: Vec<[i32; 4]> =
            places.iter().zip(names).map(|((x, y), name)| [*x, *y, x + 7 * name.len() as i32, y + NAME]).collect();
        for (i, a) in bounds.iter().enumerate() {
            assert!(bounds[..i].iter().all(|b| a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3]), "{}", names[i]);
        }
    }

    #[test]
    fn nothing_and_one_point_and_odd_numbers_can_be_drawn() {
        let odd = vec![[0.0, f64::NAN], [1.0, 0.0], [f64::INFINITY, 1.0]];
        for points in [vec![], vec![[3.0, 4.0]], odd] {
            for logarithmic in [[false; 2], [true; 2], [true, false], [false, true]] {
                for drawn in [Drawn::Area, Drawn::Line, Drawn::Total, Drawn::Limit] {
                    let chart = Chart { logarithmic, ..chart(vec![Curve::new("<", drawn, points.clone())]) };
                    let Drawing { svg, inside, along } = chart.draw().unwrap();
                    assert!(roxmltree::Document::parse(&svg).is_ok(), "{svg}");
                    assert!(inside[0] < inside[1] && inside[2] < inside[3] && along[0] < along[1], "{inside:?} {along:?}");
                }
            }
        }
    }

    #[test]
    fn embedded_its_colors_are_the_pages() {
        let drawing = chart(vec![Curve::new("a", Drawn::Line, vec![[0.0, 1.0], [1.0, 2.0]])]).draw().unwrap();
        let embedded = drawing.embedded();
        assert!(drawing.svg.contains("#2A6A3C") && !embedded.contains("\"#"), "{embedded}");
        assert!(embedded.contains("var(--c0)") && !embedded.contains("http"));
        // The light colours are those of the style.
        for (name, RGBColor(r, g, b)) in COLORS {
            assert!(crate::page::STYLE.contains(&format!("--{name}: #{r:02x}{g:02x}{b:02x}")), "{name}");
        }
    }
}
