// What the linear method cannot do without, at its plainest: one gather of every pixel, and two
// scatters of every cell, by the same arithmetic on the same planes.

struct Params {
    size: vec2<u32>,
    cells: vec2<u32>,
    phase: i32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> color: array<u32>;
@group(0) @binding(2) var<storage, read> velocity: array<u32>;
@group(0) @binding(3) var<storage, read> depth: array<u32>;
@group(0) @binding(4) var<storage, read_write> top: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> splat: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> out: array<u32>;

fn displacement(word: u32) -> vec2<i32> {
    let v = vec2<i32>(bitcast<i32>(word << 16u) >> 16u, bitcast<i32>(word) >> 16u);
    return (v * params.phase + 256) >> vec2<u32>(9u);
}

fn channels(at: vec2<i32>) -> vec4<u32> {
    let word = color[u32(at.y) * params.size.x + u32(at.x)];
    return (vec4<u32>(word) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(0xffu);
}

@compute @workgroup_size(16, 16)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= params.size) {
        return;
    }
    let cell = pixel * params.cells / params.size;
    let last = vec2<i32>(params.size) - 1;
    let moved = vec2<i32>(pixel << vec2<u32>(8u))
        - displacement(velocity[cell.y * params.cells.x + cell.x]);
    let place = clamp(moved, vec2<i32>(0), last << vec2<u32>(8u));
    let low = place >> vec2<u32>(8u);
    let high = min(low + 1, last);
    let f = vec2<u32>(place & vec2<i32>(0xff));
    let g = 256u - f;
    let sum = channels(low) * (g.x * g.y)
        + channels(vec2<i32>(high.x, low.y)) * (f.x * g.y)
        + channels(vec2<i32>(low.x, high.y)) * (g.x * f.y)
        + channels(high) * (f.x * f.y);
    let parts = ((sum + 32768u) >> vec4<u32>(16u)) << vec4<u32>(0u, 8u, 16u, 24u);
    out[pixel.y * params.size.x + pixel.x] = parts.x | parts.y | parts.z | parts.w;
}

// The cell left of and above the place where a cell lands.
fn landing(cell: vec2<u32>) -> vec2<i32> {
    let moved = displacement(velocity[cell.y * params.cells.x + cell.x]);
    let scaled = moved * vec2<i32>(params.cells) / vec2<i32>(params.size);
    return (vec2<i32>(cell << vec2<u32>(8u)) + scaled) >> vec2<u32>(8u);
}

@compute @workgroup_size(16, 16)
fn scatter_depth(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.cells) {
        return;
    }
    let land = landing(id.xy);
    let word = depth[id.y * params.cells.x + id.x];
    for (var corner = 0u; corner < 4u; corner++) {
        let cell = vec2<u32>(land + vec2<i32>(vec2<u32>(corner & 1u, corner >> 1u)));
        if all(cell < params.cells) {
            atomicMax(&top[cell.y * params.cells.x + cell.x], word);
        }
    }
}

@compute @workgroup_size(16, 16)
fn scatter_source(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= params.cells) {
        return;
    }
    let land = landing(id.xy);
    let source = id.y * params.cells.x + id.x;
    let word = depth[source];
    for (var corner = 0u; corner < 4u; corner++) {
        let cell = vec2<u32>(land + vec2<i32>(vec2<u32>(corner & 1u, corner >> 1u)));
        if all(cell < params.cells) {
            let i = cell.y * params.cells.x + cell.x;
            if word >= atomicLoad(&top[i]) - (word >> 8u) {
                atomicMax(&splat[i], source);
            }
        }
    }
}
