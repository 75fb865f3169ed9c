// The snapped grid from its mesh on, the twin of `mesh.rs` (advance), `triangle.rs` and
// `raster.rs`. The mesh of a key is made on the CPU, once.
//
// Where the CPU walks spans of bands, here eight invocations share the rows of a triangle and ask
// every pixel of its bounding box; the pixels inside are the same. Two atomic passes, free of
// order, choose the triangle of each pixel.

// Per vertex: x and y in 1/16 px, velocity, depth key.
@group(0) @binding(3) var<storage, read> vertices: array<vec4<u32>>;
// Per cell: 0 where the cut falls from the top left, 1 where it rises from the bottom left.
@group(0) @binding(4) var<storage, read> cuts: array<u32>;
@group(0) @binding(5) var<storage, read_write> triangles: array<Triangle>;
// Per pixel: the largest depth of its triangles, and the one that it shows.
@group(0) @binding(6) var<storage, read_write> nearest: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> shown: array<atomic<u32>>;

const FARTHEST: i32 = 8064;
const NO_TRIANGLE: u32 = 0xffffffffu;
// Invocations that share the rows of a triangle.
const LANES: u32 = 8u;

// A triangle after the warp, and the affine map from target to source, equation (2).
struct Triangle {
    a: vec2<i32>,
    b: vec2<i32>,
    c: vec2<i32>,
    // Of the first corner.
    source: vec2<i32>,
    // 2^-24 px of source per 1/16 px of target: x by x, x by y, y by x, y by y.
    gradient: vec4<i32>,
    depth: u32,
    is_upright: u32,
}

fn triangles_of_a_row() -> u32 {
    return 2u * params.mesh_cells.x;
}

@compute @workgroup_size(16, 16)
fn clear_pixels(@builtin(global_invocation_id) id: vec3<u32>) {
    if !is_inside(id.xy, params.size) {
        return;
    }
    let i = id.y * params.size.x + id.x;
    atomicStore(&nearest[i], 0u);
    atomicStore(&shown[i], NO_TRIANGLE);
}

// Twice the area of a triangle in 1/256 px^2, positive when its corners run clockwise.
fn cross_of(a: vec2<i32>, b: vec2<i32>, c: vec2<i32>) -> i32 {
    return (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
}

// (1)
fn moved(vertex: vec4<u32>) -> vec2<i32> {
    let sixteenths = (displacement(vertex.z) + 8) >> vec2<u32>(4u);
    return vec2<i32>(vertex.xy) + clamp(sixteenths, vec2<i32>(-FARTHEST), vec2<i32>(FARTHEST));
}

// numerator / area in 2^-20, rounded to nearest, its low 32 bits; area is positive. The quotient
// has 64 bits: 20 of them come by shift and subtract.
fn ratio(numerator: i32, area: i32) -> i32 {
    var whole = numerator / area;
    var rest = numerator - whole * area;
    if rest < 0 {
        whole--;
        rest += area;
    }
    let divisor = u32(area);
    var remainder = u32(rest);
    var quotient = u32(whole);
    for (var bit = 0u; bit < 20u; bit++) {
        remainder <<= 1u;
        quotient <<= 1u;
        if remainder >= divisor {
            remainder -= divisor;
            quotient++;
        }
    }
    let rounds_up = remainder + (divisor >> 1u) >= divisor;
    return bitcast<i32>(quotient + select(0u, 1u, rounds_up));
}

@compute @workgroup_size(64, 1)
fn set_up(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= triangles_of_a_row() || id.y >= params.mesh_cells.y {
        return;
    }
    let cell = vec2<u32>(id.x >> 1u, id.y);
    let columns = params.mesh_cells.x + 1u;
    let first = cell.y * columns + cell.x;
    // Corners: top left, top right, bottom left, bottom right.
    let quad = array<u32, 4>(first, first + 1u, first + columns, first + columns + 1u);
    let rises = cuts[cell.y * params.mesh_cells.x + cell.x] == 1u;
    let is_second = (id.x & 1u) == 1u;
    // Falling: 0 1 3 and 0 3 2. Rising: 0 1 2 and 1 3 2.
    let v0 = vertices[select(quad[0], quad[1], rises && is_second)];
    let v1 = vertices[select(quad[1], quad[3], is_second)];
    let v2 = vertices[select(select(quad[3], quad[2], rises), quad[2], is_second)];
    var triangle: Triangle;
    triangle.a = moved(v0);
    triangle.b = moved(v1);
    triangle.c = moved(v2);
    triangle.source = vec2<i32>(v0.xy);
    // Without the bit that the CPU marks painted pixels with.
    triangle.depth = min(min(v0.w, v1.w), v2.w) >> 1u;
    let area = cross_of(triangle.a, triangle.b, triangle.c);
    triangle.is_upright = select(0u, 1u, area > 0);
    if area > 0 {
        let b = triangle.b - triangle.a;
        let c = triangle.c - triangle.a;
        let t = vec2<i32>(v1.xy) - triangle.source;
        let u = vec2<i32>(v2.xy) - triangle.source;
        triangle.gradient = vec4<i32>(
            ratio(t.x * c.y - u.x * b.y, area),
            ratio(u.x * b.x - t.x * c.x, area),
            ratio(t.y * c.y - u.y * b.y, area),
            ratio(u.y * b.x - t.y * c.x, area),
        );
    }
    triangles[id.y * triangles_of_a_row() + id.x] = triangle;
}

// Whether a pixel centre is on the inner side of an edge, by the top-left rule.
fn is_within(a: vec2<i32>, b: vec2<i32>, p: vec2<i32>) -> bool {
    let d = b - a;
    let threshold = select(1, 0, d.y < 0 || (d.y == 0 && d.x > 0));
    return d.x * (p.y - a.y) - d.y * (p.x - a.x) >= threshold;
}

fn covers(triangle: Triangle, pixel: vec2<i32>) -> bool {
    let p = pixel * 16;
    return is_within(triangle.a, triangle.b, p)
        && is_within(triangle.b, triangle.c, p)
        && is_within(triangle.c, triangle.a, p);
}

// First and last pixel of a triangle's bounding box inside the valid rectangle.
fn first_pixel(triangle: Triangle) -> vec2<i32> {
    let low = (min(min(triangle.a, triangle.b), triangle.c) + 15) >> vec2<u32>(4u);
    return max(low, vec2<i32>(params.valid_start));
}

fn last_pixel(triangle: Triangle) -> vec2<i32> {
    let high = max(max(triangle.a, triangle.b), triangle.c) >> vec2<u32>(4u);
    return min(high, vec2<i32>(params.valid_start + params.valid_size) - 1);
}

// (3), the first pass: the largest depth.
@compute @workgroup_size(64, 1)
fn find_nearest(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x / LANES;
    if column >= triangles_of_a_row() || id.y >= params.mesh_cells.y {
        return;
    }
    let triangle = triangles[id.y * triangles_of_a_row() + column];
    if triangle.is_upright == 0u {
        return;
    }
    let first = first_pixel(triangle);
    let last = last_pixel(triangle);
    for (var y = first.y + i32(id.x % LANES); y <= last.y; y += i32(LANES)) {
        for (var x = first.x; x <= last.x; x++) {
            if covers(triangle, vec2<i32>(x, y)) {
                atomicMax(&nearest[u32(y) * params.size.x + u32(x)], triangle.depth);
            }
        }
    }
}

// (3), the second pass: the first within the tolerance of it.
@compute @workgroup_size(64, 1)
fn choose_triangle(@builtin(global_invocation_id) id: vec3<u32>) {
    let column = id.x / LANES;
    if column >= triangles_of_a_row() || id.y >= params.mesh_cells.y {
        return;
    }
    let index = id.y * triangles_of_a_row() + column;
    let triangle = triangles[index];
    if triangle.is_upright == 0u {
        return;
    }
    let first = first_pixel(triangle);
    let last = last_pixel(triangle);
    for (var y = first.y + i32(id.x % LANES); y <= last.y; y += i32(LANES)) {
        for (var x = first.x; x <= last.x; x++) {
            let i = u32(y) * params.size.x + u32(x);
            if covers(triangle, vec2<i32>(x, y))
                && is_as_near(triangle.depth, atomicLoad(&nearest[i])) {
                atomicMin(&shown[i], index);
            }
        }
    }
}

@compute @workgroup_size(16, 16)
fn warp_grid(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if !is_inside(pixel, params.size) {
        return;
    }
    let index = atomicLoad(&shown[pixel.y * params.size.x + pixel.x]);
    if !is_valid(pixel) || index == NO_TRIANGLE {
        write_out(pixel, read_color(pixel));
        return;
    }
    // (2)
    let triangle = triangles[index];
    let d = vec2<i32>(pixel) * 16 - triangle.a;
    let relative = triangle.gradient.xz * d.x + triangle.gradient.yw * d.y;
    write_out(pixel, sample(triangle.source * 16 + ((relative + 32768) >> vec2<u32>(16u))));
}
