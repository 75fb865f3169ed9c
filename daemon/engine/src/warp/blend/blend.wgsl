// Mean of two keys, the twin of `cpu.rs`.

@group(0) @binding(3) var<storage, read> older: array<u32>;

fn read_older(pixel: vec2<u32>) -> Texel {
    let index = pixel.y * params.size.x + pixel.x;
    if FORMAT == RGBA16F {
        return Texel(older[2u * index], older[2u * index + 1u]);
    }
    return Texel(older[index], 0u);
}

@compute @workgroup_size(16, 16)
fn blend(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if !is_inside(pixel, params.size) {
        return;
    }
    // (1)
    write_out(pixel, mix_texels(read_older(pixel), read_color(pixel), 128u));
}
