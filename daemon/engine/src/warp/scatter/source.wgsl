// What the scatter reads of a key, the twin of `source.rs`: velocities with 0 where
// none is known, and the depth of the surface that each velocity is of.

@group(0) @binding(1) var<storage, read> velocity: array<u32>;
@group(0) @binding(2) var<storage, read> depth: array<u32>;
@group(0) @binding(3) var<storage, read_write> held: array<u32>;
@group(0) @binding(4) var<storage, read_write> near: array<u32>;

@compute @workgroup_size(16, 16)
fn take_key(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = id.xy;
    if !is_inside(cell, params.cells) {
        return;
    }
    let i = cell_index(cell);
    let word = select(velocity[i], 0u, velocity[i] == HOLE);
    held[i] = word;
    if params.has_depth != 0u {
        near[i] = dilated_depth(cell);
    } else {
        // A faster surface counts as nearer.
        let speed = abs(velocity_of(word));
        near[i] = u32(speed.x + speed.y) >> 5u;
    }
}

// (2) of `trajectory/dilate_motion`.
fn dilated_depth(cell: vec2<u32>) -> u32 {
    let centre = depth[cell_index(cell)];
    let first = max(cell, vec2<u32>(1u)) - 1u;
    let last = min(cell + 1u, params.cells - 1u);
    var nearest = 0u;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            nearest = max(nearest, depth[cell_index(vec2<u32>(x, y))]);
        }
    }
    return select(centre, nearest, nearest - centre > nearest >> 8u);
}
