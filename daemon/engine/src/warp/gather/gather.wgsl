// Backward warp, the twin of `cpu.rs`.

@group(0) @binding(4) var<storage, read> velocity: array<u32>;

@compute @workgroup_size(16, 16)
fn warp_gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if !is_inside(pixel, params.size) {
        return;
    }
    if !is_valid(pixel) {
        write_out(pixel, read_color(pixel));
        return;
    }
    let index = pixel - params.valid_start;
    let cell = vec2<u32>(place_x(index.x).cell, place_y(index.y).cell);
    // (1)
    let p = vec2<i32>(pixel << vec2<u32>(8u));
    write_out(pixel, sample(p - displacement(velocity[cell_index(cell)])));
}
