// The velocity that, scaled by the phase, moves a point as far as its velocity and acceleration do:
// the twin of `cpu.rs`, into the field that the scatter reads, with 0 where no velocity is known.

@group(0) @binding(1) var<storage, read> velocity: array<u32>;
@group(0) @binding(2) var<storage, read> acceleration: array<u32>;
@group(0) @binding(3) var<storage, read_write> held: array<u32>;

// 1023 pixels.
const LARGEST: i32 = 32736;

@compute @workgroup_size(16, 16)
fn effective_velocity(@builtin(global_invocation_id) id: vec3<u32>) {
    let cell = id.xy;
    if !is_inside(cell, params.cells) {
        return;
    }
    let i = cell_index(cell);
    if velocity[i] == HOLE {
        held[i] = 0u;
        return;
    }
    // (1)
    let gained = (velocity_of(acceleration[i]) * params.phase + 4096) >> vec2<u32>(13u, 13u);
    let moved = clamp(velocity_of(velocity[i]) + gained, vec2<i32>(-LARGEST), vec2<i32>(LARGEST));
    held[i] = (bitcast<u32>(moved.x) & 0xffffu) | bitcast<u32>(moved.y) << 16u;
}
