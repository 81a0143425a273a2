// Sun, sky and the light that the ground throws back. Base colours are the photograph's without its shading; light multiplies them.
#import shared/frame

// How much sunlight a leaf lets through for what it throws back (Jacquemoud & Baret 1990: near a half where both are largest).
const TRANSLUCENCY: f32 = 0.55;

// Leaves let yellow-green through: what passes them is of a warmer green than what they reflect.
const THROUGH_LEAVES: vec3f = vec3f(1.15, 1.1, 0.45);

// Light from all round on a face turned `n`.
fn ambient(n: vec3f) -> vec3f {
    return mix(frame.ground_color, frame.sky_color, 0.5 + 0.5 * n.y);
}

// Sunlight on something solid.
fn sun_on_face(n: vec3f) -> vec3f {
    return frame.sun_color * max(dot(n, frame.toward_sun), 0.0);
}

// Sunlight on foliage: leaves point everywhere about `n`, so that light wraps round; against the sun they glow.
fn sun_on_foliage(n: vec3f, toward_eye: vec3f) -> vec3f {
    let wrapped = max((dot(n, frame.toward_sun) + 0.35) / 1.35, 0.0);
    let against = max(-dot(toward_eye, frame.toward_sun), 0.0);
    return frame.sun_color * (wrapped + TRANSLUCENCY * (0.08 + 0.92 * against * against * against) * THROUGH_LEAVES);
}

// Linear light as a picture holds it: what is brighter than three quarters runs out softly instead of being cut, with its hue.
fn held(color: vec3f) -> vec3f {
    let brightest = max(color.r, max(color.g, color.b));
    if brightest <= 0.75 {
        return color;
    }
    return color * ((1.0 - 0.25 * exp(-(brightest - 0.75) / 0.25)) / brightest);
}
