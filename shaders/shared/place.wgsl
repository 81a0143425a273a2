// Where trees stand, and who looks at them.
#import shared/frame
#import shared/sway

// What vertex stages of placed trees take in of an instance.
struct Standing {
    // Where its foot is, world space, and its scale.
    foot: vec3f,
    scale: f32,
    // Unit quaternion.
    rotation: vec4f,
}

fn standing(place: vec4f, rotation: vec4f) -> Standing {
    return Standing(place.xyz, place.w, normalize(rotation));
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

fn turned_back(q: vec4f, v: vec3f) -> vec3f {
    return turned(vec4f(-q.xyz, q.w), v);
}

// Where a point of a tree stands in still air, world space.
fn still(tree: Standing, at: vec3f) -> vec3f {
    return tree.foot + tree.scale * turned(tree.rotation, at);
}

// Where the wind has put it.
fn swayed(tree: Standing, at: vec3f, tree_height_m: f32, tree_foot_m: f32) -> vec3f {
    return tree.foot + tree.scale * (turned(tree.rotation, at) + sway(at - vec3f(0.0, tree_foot_m, 0.0), tree_height_m, tree.foot));
}

// Towards whom a pass draws for, from a point of a tree, unit length, object space: the viewer, or in the sun's map the sun.
fn toward_seer(tree: Standing, at: vec3f, for_sun: bool) -> vec3f {
    if for_sun {
        return turned_back(tree.rotation, frame.toward_sun);
    }
    return turned_back(tree.rotation, toward_eye(still(tree, at)));
}
