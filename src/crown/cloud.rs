//! The point cloud: feature points revolved around the axis in rings, the profile of one side blending into that of the next, then
//! disturbed inside the ellipsoid EDFP (She §3.1, fig. 8a, 9b, 9d). Metres, object space.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec3, Vec3};

use super::CrownParams;
use super::hull::Hull;
use crate::Seed;

/// Samples of a side's profile from bottom to top.
const SAMPLES: usize = 1441;
/// How much wider than high a cell of rings and columns is: the profile is what one sees against the sky.
const CELL_ASPECT: f64 = 1.5;
/// A ring has half the columns of the next where they would stand closer than this, as a fraction of their widest distance.
const CROWDED: f64 = 0.62;
/// How far around the axis a side's own twigs reach, radians; beyond, the profile is the smoothed one.
const TWIG_REACH: f64 = 0.2;
/// The part of the radial disturbance that a seen outline withstands, and how far around the axis that reaches, radians.
const SEEN_CALM: f64 = 0.7;
const SEEN_REACH: f64 = 0.3;
/// Farthest a feature point may stand off the mean of its ring's sector, as a fraction of the distance between rings.
const SPIKE: f64 = 0.5;
/// Standard deviation of that smoothing, as a fraction of the profile's length.
const SMOOTHING: f64 = 0.08;

/// The points of a crown and how they hang together.
pub(super) struct Cloud {
    /// Bottom pole, rings from below, top pole; relative to the hull's centre.
    pub points: Vec<DVec3>,
    /// Unit vectors whose spherical Delaunay triangulation joins the points: the conformal image of the surface on the sphere, on
    /// which rings are as far apart as their points are.
    pub chart: Vec<DVec3>,
    /// EDFP of every point: semi-axes across the surface, along the profile, and around.
    pub edfp: Vec<[DVec3; 3]>,
}

/// One side's outline as a curve over the elevation seen from the centre.
struct Profile {
    azimuth_rad: f64,
    radius: Vec<f64>,
    /// Arc length up to each sample as a fraction of the whole.
    length: Vec<f64>,
    total_m: f64,
    /// Feature points: elevation and radius, from below.
    features: Vec<(f64, f64)>,
}

/// One side's sample on one ring (or pole).
#[derive(Clone, Copy)]
struct Mark {
    elevation: f64,
    /// As in the outline.
    exact: f64,
    /// Without twigs.
    smooth: f64,
}

/// How many columns and where the rings are.
struct Layout {
    columns: Vec<usize>,
    spacing_m: f64,
}

fn elevation(sample: usize) -> f64 {
    (sample as f64 / (SAMPLES - 1) as f64 - 0.5) * PI
}

/// The cloud of `hull` whose surface has about `polygons` triangles and quads.
pub(super) fn cloud(hull: &Hull, polygons: usize, params: &CrownParams) -> Cloud {
    let profiles = profiles(hull);
    let layout = layout(&profiles, polygons);
    let rings = layout.columns.len();
    // marks[side][0] is the bottom pole, then the rings, then the top pole.
    let marks: Vec<Vec<Mark>> = profiles.iter().map(|p| marks(p, rings)).collect();
    let mean = |f: &dyn Fn(&Mark) -> f64, ring: usize| marks.iter().map(|m| f(&m[ring])).sum::<f64>() / marks.len() as f64;
    // Half of the elevation that a ring stands for: what its limits are averaged over.
    let half_rad = |ring: usize| {
        let (below, above) = (ring.saturating_sub(1), (ring + 1).min(rings + 1));
        0.25 * (mean(&|m| m.elevation, above) - mean(&|m| m.elevation, below))
    };
    let pole = |ring: usize| (mean(&|m| m.exact, ring), hull.limit(hull.direction(marks[0][ring].elevation, 0.0), half_rad(ring)));

    // The ring's radius about the axis and its height along it, on average: what spacing and tangents are measured on.
    let across: Vec<f64> = (0..rings + 2).map(|k| mean(&|m| m.smooth * m.elevation.cos(), k).max(1e-6)).collect();
    let height: Vec<f64> = (0..rings + 2).map(|k| mean(&|m| m.smooth * m.elevation.sin(), k)).collect();
    let isometric = isometric_latitudes(&across, &height);

    let mut cloud = Cloud { points: vec![], chart: vec![], edfp: vec![] };
    let [radial, along_profile, around_axis] =
        [params.edfp_radial, params.edfp_along, params.edfp_around].map(|semi_axis| params.disturb * semi_axis);
    let bottom = pole(0);
    cloud.push(-hull.axis * bottom.0.min(bottom.1), -DVec3::Y, [-hull.axis * bottom.0 * radial, DVec3::ZERO, DVec3::ZERO]);
    for ring in 1..=rings {
        let columns = layout.columns[ring - 1];
        let (du, dh) = (across[ring + 1] - across[ring - 1], height[ring + 1] - height[ring - 1]);
        for column in 0..columns {
            let azimuth = column as f64 / columns as f64 * TAU;
            let (elevation, radius, own) = revolved(&profiles, &marks, ring, azimuth);
            let d = hull.direction(elevation, azimuth);
            let radius = if own { radius } else { radius.min(hull.limit(d, half_rad(ring))) };
            let outward = hull.outward(azimuth);
            let along = (outward * du + hull.axis * dh).normalize_or(hull.axis);
            let around = hull.axis.cross(outward);
            let normal = around.cross(along);
            // How far it is along the normal to the axis: the tip of a cone is thin, however far from the centre.
            let thickness = across[ring] / normal.dot(outward).abs().max(1e-6);
            let semi_axes = [
                normal * radial * freedom(&profiles, azimuth) * thickness.min(radius),
                along * along_profile * layout.spacing_m,
                around * around_axis * (TAU * across[ring] / columns as f64),
            ];
            let (sin, cos) = azimuth.sin_cos();
            let (up, out) = (isometric[ring - 1].tanh(), 1.0 / isometric[ring - 1].cosh());
            cloud.push(d * radius, DVec3::new(out * cos, up, -out * sin).normalize(), semi_axes);
        }
    }
    let top = pole(rings + 1);
    cloud.push(hull.axis * top.0.min(top.1), DVec3::Y, [hull.axis * top.0 * radial, DVec3::ZERO, DVec3::ZERO]);
    cloud
}

impl Cloud {
    fn push(&mut self, point: DVec3, chart: DVec3, edfp: [DVec3; 3]) {
        self.points.push(point);
        self.chart.push(chart);
        self.edfp.push(edfp);
    }

    /// Each point's displacement inside its EDFP; keyed by the point's index and, for the part it shares with its neighbours, by place.
    pub fn displacements(&self, seed: Seed, crown: usize, params: &CrownParams) -> Vec<DVec3> {
        let mean_radius = self.points.iter().map(|p| p.length()).sum::<f64>() / self.points.len() as f64;
        let clump_m = params.edfp_clump_size * mean_radius;
        let displacement = |(i, axes): (usize, &[DVec3; 3])| {
            let mut draws = seed.keyed("edfp", ((crown as u64) << 32) | i as u64);
            let mut ball = || DVec3::new(draws.signed(), draws.signed(), draws.signed());
            // Rejection keeps a bit over half; after thirty misses the middle is fair enough.
            let p = (0..30).map(|_| ball()).find(|p| p.length_squared() <= 1.0).unwrap_or(DVec3::ZERO);
            // Scaled to the ellipsoid's depth here, so that the sum stays inside.
            let depth = (1.0 - p.y * p.y - p.z * p.z).sqrt();
            let clump = smooth_noise(seed, crown as u64, self.points[i] / clump_m) * depth;
            // A point's own part is no deeper than it is wide, lest fine surfaces crumple into needles.
            let own = p.x * (axes[1].length() / axes[0].length().max(1e-12)).min(1.0);
            axes[0] * (clump + (own - clump) * (1.0 - params.edfp_clump)) + axes[1] * p.y + axes[2] * p.z
        };
        self.edfp.iter().enumerate().map(displacement).collect()
    }
}

/// Noise in −1..1 that changes over a unit of length: random numbers on a lattice, blended smoothly in between.
fn smooth_noise(seed: Seed, crown: u64, p: DVec3) -> f64 {
    let cell = p.floor();
    let t = p - cell;
    let ease = t * t * (DVec3::splat(3.0) - 2.0 * t);
    let corner = |k: u32| {
        let offset = DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let weight = (DVec3::ONE - offset) * (DVec3::ONE - ease) + offset * ease;
        // 20 bits per axis hold any crown; the crown's number fills the rest.
        let key = (cell + offset).to_array().iter().fold(crown, |key, &c| (key << 20) ^ (c as i64 & 0xf_ffff) as u64);
        weight.element_product() * seed.keyed("clump", key).signed()
    };
    (0..8).map(corner).sum()
}

/// The part of the radial disturbance that a point may take: where a photograph shows the outline, that outline already has its lumps,
/// and more of them would only take it away from what was seen.
fn freedom(profiles: &[Profile], azimuth: f64) -> f64 {
    let turn = |p: &Profile| (azimuth - p.azimuth_rad).rem_euclid(TAU);
    let apart = |p: &Profile| turn(p).min(TAU - turn(p));
    let nearest = profiles.iter().map(apart).fold(PI, f64::min);
    1.0 - SEEN_CALM * (-(nearest / SEEN_REACH).powi(2)).exp()
}

/// Elevation and radius of a ring at an azimuth, and whether that is exactly a side's own outline.
fn revolved(profiles: &[Profile], marks: &[Vec<Mark>], ring: usize, azimuth: f64) -> (f64, f64, bool) {
    // The two sides this azimuth lies between; the blend leaves both with zero slope (a cosine).
    let n = profiles.len();
    let next = profiles.partition_point(|p| p.azimuth_rad <= azimuth + 1e-9) % n;
    let last = (next + n - 1) % n;
    let turn = |from: f64, to: f64| (to - from).rem_euclid(TAU);
    let gap = turn(profiles[last].azimuth_rad, profiles[next].azimuth_rad);
    let gap = if n == 1 { TAU } else { gap };
    let along = turn(profiles[last].azimuth_rad, azimuth + 1e-9).min(gap) - 1e-9;
    let weight = 0.5 - 0.5 * (along.max(0.0) / gap * PI).cos();
    let (a, b) = (marks[last][ring], marks[next][ring]);
    let twig = |m: Mark, distance: f64| (m.exact - m.smooth) * (-(distance / TWIG_REACH).powi(2)).exp();
    let radius = (1.0 - weight) * (a.smooth + twig(a, along)) + weight * (b.smooth + twig(b, gap - along));
    ((1.0 - weight) * a.elevation + weight * b.elevation, radius, along.abs() < 1e-6)
}

/// The sides' profiles, by azimuth; sides that stand within a degree of each other are averaged.
fn profiles(hull: &Hull) -> Vec<Profile> {
    let mut groups: Vec<Vec<&super::hull::Side>> = Vec::new();
    for side in &hull.sides {
        match groups.last_mut().filter(|g| side.azimuth_rad - g[0].azimuth_rad < 1f64.to_radians()) {
            Some(group) => group.push(side),
            None => groups.push(vec![side]),
        }
    }
    // Zero and a full turn are neighbours, too.
    if groups.len() > 1 && TAU - groups[groups.len() - 1][0].azimuth_rad < 1f64.to_radians() {
        let last = groups.pop().expect("there are at least two groups");
        groups[0].extend(last);
    }
    groups.iter().map(|group| profile(hull, group)).collect()
}

fn profile(hull: &Hull, sides: &[&super::hull::Side]) -> Profile {
    let azimuth_rad = sides[0].azimuth_rad;
    let step = PI / (SAMPLES - 1) as f64;
    let radius_at = |i: usize| {
        let d = hull.direction(elevation(i), azimuth_rad);
        sides.iter().map(|s| hull.views[s.view].limit(d, 0.0)).sum::<f64>() / sides.len() as f64
    };
    let radius: Vec<f64> = (0..SAMPLES).map(radius_at).collect();
    // Arc length of the curve without its jumps: rings crowded into one elevation would be slivers.
    let calm = gaussian(&radius, 1f64.to_radians() / step);
    let slope = |i: usize| (calm[(i + 1).min(SAMPLES - 1)] - calm[i.saturating_sub(1)]) / (2.0 * step);
    let mut length = vec![0.0];
    for i in 1..SAMPLES {
        length.push(length[i - 1] + step * calm[i].hypot(slope(i).abs().min(8.0 * calm[i])));
    }
    let total_m = length[SAMPLES - 1];
    length.iter_mut().for_each(|l| *l /= total_m);
    let features = if sides.len() == 1 { features(hull, sides[0]) } else { vec![] };
    Profile { azimuth_rad, radius, length, total_m, features }
}

/// The view's feature points on one side of the axis, as elevation and radius, from below.
fn features(hull: &Hull, side: &super::hull::Side) -> Vec<(f64, f64)> {
    let view = &hull.views[side.view];
    let up = view.project(hull.axis).normalize();
    let out = view.project(hull.outward(side.azimuth_rad)).normalize();
    let polar = |p: &glam::DVec2| (p.dot(up).atan2(p.dot(out)), p.length());
    let mut found: Vec<(f64, f64)> = view.features.iter().filter(|p| p.dot(out) > 0.0).map(polar).collect();
    found.retain(|(e, _)| e.abs() < FRAC_PI_2 - 0.02);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// A side's samples on the poles and on `rings` rings spaced evenly along it, moved to the feature points near them.
fn marks(profile: &Profile, rings: usize) -> Vec<Mark> {
    let spacing = 1.0 / (rings + 1) as f64;
    let at_length = |t: f64| {
        let i = profile.length.partition_point(|&l| l < t).clamp(1, SAMPLES - 1);
        let (a, b) = (profile.length[i - 1], profile.length[i]);
        elevation(i - 1) + ((t - a) / (b - a).max(1e-12)).clamp(0.0, 1.0) * PI / (SAMPLES - 1) as f64
    };
    let sample = |e: f64| ((e / PI + 0.5) * (SAMPLES - 1) as f64).clamp(0.0, (SAMPLES - 1) as f64);
    let length_at = |e: f64| profile.length[sample(e).round() as usize];
    let even: Vec<f64> = (0..rings + 2).map(|k| at_length(k as f64 * spacing)).collect();
    let mut marks: Vec<Mark> = Vec::with_capacity(rings + 2);
    for k in 0..rings + 2 {
        let (from, to) = (even[k.saturating_sub(1)], even[(k + 1).min(rings + 1)]);
        let near = |(e, _): &&(f64, f64)| (length_at(*e) - k as f64 * spacing).abs() < 0.4 * spacing;
        let nearest = |e: f64| (length_at(e) - k as f64 * spacing).abs();
        // The radius that sweeps the area of the ring's sector.
        let (a, b) = (sample(0.5 * (from + even[k])), sample(0.5 * (to + even[k])));
        let sector = &profile.radius[a.round() as usize..=b.round() as usize];
        let swept = (sector.iter().map(|r| r * r).sum::<f64>() / sector.len() as f64).sqrt();
        // A feature point finer than the rings would be a spike, or a notch, as wide as they are apart.
        let fitting = |f: &&(f64, f64)| near(f) && (f.1 - swept).abs() < SPIKE * spacing * profile.total_m;
        let feature = profile.features.iter().filter(fitting).min_by(|a, b| nearest(a.0).total_cmp(&nearest(b.0)));
        let inner = (1..=rings).contains(&k);
        let (elevation, exact) = feature.copied().filter(|_| inner).unwrap_or((even[k], swept));
        marks.push(Mark { elevation, exact, smooth: exact });
    }
    let raw: Vec<f64> = marks.iter().map(|m| m.exact).collect();
    for k in 1..=rings {
        // A twig no wider than a ring is high would stand out as a horn: a quarter of what a ring shows is each neighbour's.
        marks[k].exact = 0.5 * raw[k] + 0.25 * (raw[k - 1] + raw[k + 1]);
    }
    let exact: Vec<f64> = marks.iter().map(|m| m.exact).collect();
    // Smoothing what smoothing took away, too ("twicing", Tukey 1977), keeps broad shapes: a column does not swell at its middle.
    let sigma = SMOOTHING * (rings + 1) as f64;
    let once = gaussian(&exact, sigma);
    let lost: Vec<f64> = exact.iter().zip(&once).map(|(e, s)| e - s).collect();
    let smooth = once.iter().zip(gaussian(&lost, sigma)).map(|(s, l)| s + l);
    marks.iter_mut().zip(smooth).for_each(|(m, s)| m.smooth = s.max(0.2 * m.exact));
    marks
}

/// Columns per ring and the number of rings that make about `polygons` triangles and quads of even size.
fn layout(profiles: &[Profile], polygons: usize) -> Layout {
    let n = profiles.len() as f64;
    let length_m = profiles.iter().map(|p| p.total_m).sum::<f64>() / n;
    let radius_at = |t: f64| {
        let of = |p: &Profile| {
            let i = p.length.partition_point(|&l| l < t).min(SAMPLES - 1);
            p.radius[i] * elevation(i).cos()
        };
        profiles.iter().map(of).sum::<f64>() / n
    };
    let fine: Vec<f64> = (0..=200).map(|i| radius_at(f64::from(i) / 200.0)).collect();
    let across = gaussian(&fine, 200.0 * SMOOTHING);
    let widest = across.iter().fold(1e-9f64, |m, &r| m.max(r));
    let columns_of = |columns: usize, rings: usize| -> Vec<usize> {
        let radius = |ring: usize| across[((ring + 1) as f64 / (rings + 1) as f64 * 200.0).round() as usize];
        let mut levels: Vec<u32> = (0..rings)
            .map(|k| (CROWDED * widest / radius(k).max(1e-9)).log2().floor().max(-1.0) as i32 + 1)
            .map(|l| l.min(9) as u32)
            .collect();
        // Never under six columns, nor an odd number, which would miss the left outline; and one halving at a time.
        let most = (0..).take_while(|&l| columns >> l >= 6 && columns.is_multiple_of(2 << l)).last().unwrap_or(0);
        levels.iter_mut().for_each(|l| *l = (*l).min(most));
        for k in 1..rings {
            levels[k] = levels[k].min(levels[k - 1] + 1);
        }
        for k in (1..rings).rev() {
            levels[k - 1] = levels[k - 1].min(levels[k] + 1);
        }
        levels.iter().map(|&l| columns >> l).collect()
    };
    let count =
        |columns: &[usize]| columns.windows(2).map(|w| w[0].max(w[1])).sum::<usize>() + columns[0] + columns[columns.len() - 1];
    let fitting = |columns: usize| {
        // The count grows with the number of rings.
        let (mut few, mut many) = (3, 3 + 2 * polygons / columns);
        while many - few > 1 {
            let middle = (few + many) / 2;
            if count(&columns_of(columns, middle)) <= polygons { few = middle } else { many = middle }
        }
        let aspect = (TAU * widest / columns as f64) / (length_m / (few + 1) as f64);
        ((aspect / CELL_ASPECT).ln().abs(), columns, few)
    };
    let best = (1..=32).map(|k| fitting(8 * k)).min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, columns, rings) = best.expect("there are 32 candidates");
    Layout { columns: columns_of(columns, rings), spacing_m: length_m / (rings + 1) as f64 }
}

/// Isometric latitude of every ring: steps of arc length over radius, so that a square on the crown is a square in the chart.
fn isometric_latitudes(across: &[f64], height: &[f64]) -> Vec<f64> {
    let rings = across.len() - 2;
    let mut latitudes = vec![0.0];
    for k in 2..=rings {
        let step = (across[k] - across[k - 1]).hypot(height[k] - height[k - 1]);
        latitudes.push(latitudes[k - 2] + step / (0.5 * (across[k] + across[k - 1])));
    }
    // The widest ring is the chart's equator; beyond ±12 the chart's poles would run out of digits.
    let widest = (0..rings).max_by(|&a, &b| across[a + 1].total_cmp(&across[b + 1])).unwrap_or(0);
    let (equator, last) = (latitudes[widest], latitudes[rings - 1]);
    let scale = (12.0 / (last - equator).max(equator).max(1e-9)).min(1.0);
    latitudes.iter().map(|l| (l - equator) * scale).collect()
}

/// Gaussian average of a curve whose ends are held. `sigma` in samples.
fn gaussian(values: &[f64], sigma: f64) -> Vec<f64> {
    let reach = (3.0 * sigma).ceil() as i64;
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma.max(1e-9)).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let at = |i: i64| values[i.clamp(0, values.len() as i64 - 1) as usize];
    let average = |i: i64| weights.iter().zip(-reach..).map(|(w, k)| w * at(i + k)).sum::<f64>() / total;
    (0..values.len() as i64).map(average).collect()
}

/// Object-space positions of points about a centre.
pub(super) fn placed(points: &[DVec3], center: DVec3) -> Vec<Vec3> {
    points.iter().map(|p| (center + p).as_vec3()).collect()
}
