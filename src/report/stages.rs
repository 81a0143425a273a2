//! `--debug-dir`: every stage of one run, drawn over the photograph.

use glam::{DVec2, Vec3};
use image::{DynamicImage, Rgb, RgbImage, RgbaImage};

use crate::Result;
use crate::geom::{Edges, PolyMesh};
use crate::model::pipeline::{ModelRun, View, ViewProducts};
use crate::raster::{ALPHA_CUTOFF, png};

use super::{draw, sheet};

/// Height of every drawn panel, pixels.
const PANEL_PX: u32 = 640;

/// Draws all stages: file name part and PNG bytes.
///
/// # Errors
/// Those of the PNG encoder.
pub fn draw(views: &[View], run: &ModelRun) -> Result<Vec<(String, Vec<u8>)>> {
    let mut pictures = Vec::new();
    for (number, (view, products)) in views.iter().zip(&run.views).enumerate() {
        let part = |stage: &str| if views.len() == 1 { stage.to_owned() } else { format!("{stage}.view{number}") };
        pictures.push((part("1-mask"), mask_steps(&view.photo.image, products)));
        pictures.push((part("2-outline"), outline(&view.photo.image, products)));
    }
    let (photo, products) = (&views[0].photo.image, &run.views[0]);
    pictures.push(("3-cloud".to_owned(), clouds(photo, products, run)));
    pictures.push(("4-mesh".to_owned(), meshes(photo, products, run)));
    pictures.push(("5-exemplar".to_owned(), exemplar(photo, run)));
    pictures.push(("6-texture".to_owned(), textures(run)));
    pictures.push(("7-model".to_owned(), sheet::row(photo, run, PANEL_PX / 2)?));
    pictures.into_iter().map(|(name, picture)| Ok((name, png(&picture)?))).collect()
}

/// She fig. 7: the photograph, the mask after each step, and the crown that came out of it.
fn mask_steps(photo: &RgbImage, products: &ViewProducts) -> RgbImage {
    let masks = products.segmentation.steps.iter().map(|(_, mask)| DynamicImage::ImageLuma8(mask.to_gray()).into_rgb8());
    let panels: Vec<RgbImage> = std::iter::once(photo.clone())
        .chain(masks)
        .chain([draw::over_photo(photo, &products.segmentation.crown)])
        .map(|panel| draw::to_height(&panel, PANEL_PX / 2))
        .collect();
    draw::side_by_side(&panels, 8)
}

/// The contour, the axis and the turning points over the photograph (She fig. 8a).
fn outline(photo: &RgbImage, products: &ViewProducts) -> RgbImage {
    let view = PhotoPanel::new(photo);
    let mut panel = view.faded(photo);
    let silhouette = &products.silhouette;
    let at = |points: &[DVec2]| points.iter().map(|&p| view.place(p)).collect::<Vec<_>>();
    draw::polyline(&mut panel, &at(&silhouette.contour), true, draw::OUTLINE);
    draw::polyline(&mut panel, &at(&[silhouette.axis.base, silhouette.axis.top]), false, Rgb([40, 40, 40]));
    draw::dots(&mut panel, at(&silhouette.left), 3, draw::LEFT);
    draw::dots(&mut panel, at(&silhouette.right), 3, draw::RIGHT);
    if let Some(trunk) = &products.trunk {
        draw::polyline(&mut panel, &at(&[trunk.foot_px, trunk.neck_px]), false, Rgb([150, 75, 0]));
    }
    panel
}

/// The point cloud before and after disturbance (She fig. 9b, 9d), from the front.
fn clouds(photo: &RgbImage, products: &ViewProducts, run: &ModelRun) -> RgbImage {
    let view = PhotoPanel::new(photo);
    let panel = |cloud: fn(&crate::crown::Crown) -> &[Vec3]| {
        let mut panel = RgbImage::from_pixel(view.width, PANEL_PX, draw::PAPER);
        for crown in &run.crowns {
            let mut points = cloud(crown).to_vec();
            points.sort_by(|a, b| a.z.total_cmp(&b.z));
            let (back, front) = (points.first().map_or(0.0, |p| p.z), points.last().map_or(0.0, |p| p.z));
            for p in points {
                // Far points pale, near points dark: a cloud of dots has no other sign of depth.
                let near = (p.z - back) / (front - back).max(f32::EPSILON);
                let shade = (200.0 - 180.0 * near) as u8;
                draw::dots(&mut panel, [view.place(products.to_photo(p))], 1, Rgb([shade, shade, 200]));
            }
        }
        panel
    };
    draw::side_by_side(&[panel(|crown| &crown.cloud), panel(|crown| &crown.disturbed)], 8)
}

/// The surface from the front over the photograph, and from the right on paper (She fig. 9c, 9e).
fn meshes(photo: &RgbImage, products: &ViewProducts, run: &ModelRun) -> RgbImage {
    let view = PhotoPanel::new(photo);
    let mut front = view.faded(photo);
    let mut side = RgbImage::from_pixel(view.width, PANEL_PX, draw::PAPER);
    for crown in &run.crowns {
        let from_front = |p: Vec3| view.place(products.to_photo(p));
        let from_right = |p: Vec3| view.place(products.to_photo(Vec3::new(-p.z, p.y, 0.0)));
        wireframe(&mut front, &crown.mesh, Vec3::Z, from_front);
        wireframe(&mut side, &crown.mesh, Vec3::X, from_right);
    }
    draw::side_by_side(&[front, side], 8)
}

/// The edges of the polygons that face `towards`.
fn wireframe(panel: &mut RgbImage, mesh: &PolyMesh, towards: Vec3, place: impl Fn(Vec3) -> DVec2) {
    let facing: Vec<bool> = mesh
        .polygons()
        .map(|polygon| {
            let [a, b, c] = [0, 1, 2].map(|k| mesh.positions[polygon[k] as usize]);
            (b - a).cross(c - a).dot(towards) > 0.0
        })
        .collect();
    for (&(a, b), polygons) in &Edges::of(mesh).polygons {
        if polygons.iter().any(|&(polygon, _)| facing[polygon]) {
            let ends = [a, b].map(|v| place(mesh.positions[v as usize]));
            draw::polyline(panel, &ends, false, Rgb([30, 90, 40]));
        }
    }
}

/// Where the exemplar was cut, and the exemplar enlarged.
fn exemplar(photo: &RgbImage, run: &ModelRun) -> RgbImage {
    let mut framed = photo.clone();
    draw::frame(&mut framed, run.exemplars[0].window_px, draw::OUTLINE);
    let square = DynamicImage::ImageRgba8(run.exemplars[0].image.clone()).into_rgb8();
    draw::side_by_side(&[draw::to_height(&framed, PANEL_PX), draw::to_height(&square, PANEL_PX)], 8)
}

/// Per crown: the blocks with their seams as synthesised, and the baked atlas; where they are transparent a grey checker shows.
fn textures(run: &ModelRun) -> RgbImage {
    let rows: Vec<RgbImage> =
        run.atlases.iter().map(|atlas| draw::side_by_side(&[&atlas.before, &atlas.image].map(over_checker), 8)).collect();
    draw::stacked(&rows, 8)
}

/// A picture as the alpha test leaves it, over a grey checker.
fn over_checker(image: &RgbaImage) -> RgbImage {
    RgbImage::from_fn(image.width(), image.height(), |x, y| {
        let [r, g, b, alpha] = image.get_pixel(x, y).0;
        if f32::from(alpha) >= 255.0 * ALPHA_CUTOFF {
            return Rgb([r, g, b]);
        }
        if (x / 8 + y / 8).is_multiple_of(2) { Rgb([205; 3]) } else { Rgb([160; 3]) }
    })
}

/// A panel of fixed height that shows the whole photograph.
struct PhotoPanel {
    width: u32,
    scale: f64,
}

impl PhotoPanel {
    fn new(photo: &RgbImage) -> Self {
        let scale = f64::from(PANEL_PX) / f64::from(photo.height());
        Self { width: (f64::from(photo.width()) * scale).round().max(1.0) as u32, scale }
    }

    fn place(&self, photo_px: DVec2) -> DVec2 {
        photo_px * self.scale
    }

    fn faded(&self, photo: &RgbImage) -> RgbImage {
        let mut panel = draw::to_height(photo, PANEL_PX);
        for pixel in panel.pixels_mut() {
            *pixel = imageproc::pixelops::interpolate(*pixel, draw::PAPER, 0.5);
        }
        panel
    }
}
