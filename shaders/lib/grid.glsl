// Fields in space: voxels in a box, and a density that falls exponentially with height (see Grid of src/pack/layout.rs). Voxels and
// cells are read by VALUE(i), which the kernel declares.
//
// Through a density (voxels of one number, or one that falls with height) optical depths are known. Through other voxels light is tracked:
// a ray walks through cells of voxels (Amanatides and Woo 1987), of which each knows bounds of the extinction coefficient. Tentative
// collisions have the rate of the cell, so that a dense voxel costs where it is and nowhere else (Woodcock et al. 1965; Szirmay-Kalos
// et al. 2011). Distances are those along the ray; sigma_t is the extinction coefficient where the field is 1, per unit of them.
#include "lib/math.glsl"
#include "lib/rng.glsl"

// A coordinate in the unit cube, moved to [-1/2, 5/2] without moving to another voxel: by whole boxes where they repeat, by two
// where every other one is mirrored.
float grid_coordinate(float x, uint flags) {
    if ((flags & GRID_CLAMP) != 0u) {
        return clamp(x, -0.5, 1.5);
    }
    return (flags & GRID_MIRROR) != 0u ? x - 2.0 * floor(0.5 * x) : x - floor(x);
}

// The voxel of an index that may lie outside of the box by as much as grid_coordinate leaves.
uint grid_index(int index, uint size, uint flags) {
    int count = int(size);
    if ((flags & GRID_CLAMP) != 0u) {
        return uint(clamp(index, 0, count - 1));
    }
    int period = (flags & GRID_MIRROR) != 0u ? 2 * count : count;
    index = index < 0 ? index + period : index;
    index = index >= period ? index - period : index;
    return uint(index < count ? index : period - 1 - index);
}

vec3 grid_voxel(Grid grid, uint x, uint y, uint z) {
    uint index = (z * grid.size_y + y) * grid.size_x + x;
    if ((grid.flags & GRID_RGB) != 0u) {
        index = grid.first_value + 3u * index;
        return vec3(VALUE(index), VALUE(index + 1u), VALUE(index + 2u));
    }
    return vec3(VALUE(grid.first_value + index));
}

// A row of two voxels, interpolated.
vec3 grid_row(Grid grid, uvec2 x, uint y, uint z, float part) {
    vec3 low = grid_voxel(grid, x.x, y, z);
    return low + (grid_voxel(grid, x.y, y, z) - low) * part;
}

// A point in the unit cube of the voxels.
vec3 grid_local(Grid grid, vec3 point) {
    return vec3(dot(grid.row_x, point) + grid.shift_x, dot(grid.row_y, point) + grid.shift_y, dot(grid.row_z, point) + grid.shift_z);
}

// A direction in the unit cube of the voxels.
vec3 grid_direction(Grid grid, vec3 direction) {
    return vec3(dot(grid.row_x, direction), dot(grid.row_y, direction), dot(grid.row_z, direction));
}

// What can be divided by.
vec3 away_from_zero(vec3 step) {
    return mix(step, vec3(1e-20), lessThan(abs(step), vec3(1e-20)));
}

// The field at a point of the unit cube: the voxel in which it lies, or trilinear interpolation of the eight nearest centres, which
// lie at ((x + 1/2)/size_x, ...).
vec3 grid_value(Grid grid, vec3 local) {
    bool nearest = (grid.flags & GRID_NEAREST) != 0u;
    vec3 at = vec3(grid_coordinate(local.x, grid.flags), grid_coordinate(local.y, grid.flags), grid_coordinate(local.z, grid.flags));
    at = at * vec3(grid.size_x, grid.size_y, grid.size_z) - (nearest ? 0.0 : 0.5);
    vec3 low = floor(at);
    vec3 part = at - low;
    ivec3 first = ivec3(low);
    uint x = grid_index(first.x, grid.size_x, grid.flags);
    uint y = grid_index(first.y, grid.size_y, grid.flags);
    uint z = grid_index(first.z, grid.size_z, grid.flags);
    if (nearest) {
        return grid_voxel(grid, x, y, z);
    }
    uvec2 xs = uvec2(x, grid_index(first.x + 1, grid.size_x, grid.flags));
    uint next_y = grid_index(first.y + 1, grid.size_y, grid.flags);
    uint next_z = grid_index(first.z + 1, grid.size_z, grid.flags);
    vec3 near = grid_row(grid, xs, y, z, part.x);
    near += (grid_row(grid, xs, next_y, z, part.x) - near) * part.y;
    vec3 far = grid_row(grid, xs, y, next_z, part.x);
    far += (grid_row(grid, xs, next_y, next_z, part.x) - far) * part.y;
    return near + (far - near) * part.z;
}

// Where a ray is in the unit cube, (enters, leaves) between two distances; it is nowhere where it leaves before it enters.
vec2 clip_to_grid(Grid grid, vec3 origin, vec3 direction, float t_begin, float t_end) {
    vec3 from = grid_local(grid, origin);
    vec3 inverse = 1.0 / away_from_zero(grid_direction(grid, direction));
    vec3 low = -from * inverse, high = (1.0 - from) * inverse;
    vec3 near = min(low, high), far = max(low, high);
    return vec2(max(max(near.x, near.y), max(near.z, t_begin)), min(min(far.x, far.y), min(far.z, t_end)));
}

// Where a ray stands on its way through the cells.
struct GridWalk {
    vec3 origin;    // of the ray, in cells
    vec3 direction; // cells per unit of length
    ivec3 cell;
    float t;
    float end;      // where the ray leaves the box, or ends
    float least;    // integral of the smallest extinction coefficient of the cells, up to t
    float mean;     // integral of their mean
    float most;     // of the cell at t: the largest extinction coefficient
    float rate;     // of the cell at t: tentative collisions per unit of length
};

GridWalk start_grid_walk(Grid grid, vec3 origin, vec3 direction, float t_begin, float t_end) {
    vec3 cells = vec3(grid.cells_x, grid.cells_y, grid.cells_z);
    vec2 clipped = clip_to_grid(grid, origin, direction, t_begin, t_end);
    GridWalk walk;
    walk.origin = grid_local(grid, origin) * cells;
    walk.direction = away_from_zero(grid_direction(grid, direction) * cells);
    walk.t = clipped.x;
    walk.end = clipped.y;
    walk.cell = ivec3(clamp(floor(walk.origin + walk.direction * min(walk.t, walk.end)), vec3(0.0), cells - 1.0));
    walk.least = 0.0;
    walk.mean = 0.0;
    walk.most = 0.0;
    walk.rate = 0.0;
    return walk;
}

// The point of the unit cube where a walk stands.
vec3 walk_point(Grid grid, GridWalk walk) {
    return (walk.origin + walk.direction * walk.t) / vec3(grid.cells_x, grid.cells_y, grid.cells_z);
}

// Which rate a walk's tentative collisions have: that of delta tracking; what is left of the largest extinction coefficient of each cell
// without the smallest, which takes away what is known; or the mean.
const uint WALK_DELTA = 0u;
const uint WALK_RESIDUAL = 1u;
const uint WALK_MEAN = 2u;

// Where the numbers of a cell begin: the largest, the smallest and the mean extinction coefficient, and the rate of delta tracking.
uint cell_numbers(Grid grid, uvec3 cell) {
    return grid.first_cell + 4u * ((cell.z * grid.cells_y + cell.y) * grid.cells_x + cell.x);
}

// Goes on to the next tentative collision, at an optical depth tau of them, which loses what the way takes; false if the walk ends
// before.
bool walk_to_collision(Grid grid, uint kind, inout GridWalk walk, inout float tau) {
    [[dont_unroll]] while (walk.t < walk.end) {
        uint first = cell_numbers(grid, uvec3(walk.cell));
        float most = VALUE(first), least = VALUE(first + 1u), mean = VALUE(first + 2u);
        float rate = kind == WALK_DELTA ? VALUE(first + 3u) : (kind == WALK_RESIDUAL ? most - least : mean);
        vec3 side = vec3(walk.cell) + mix(vec3(0.0), vec3(1.0), greaterThan(walk.direction, vec3(0.0)));
        vec3 leaves = (side - walk.origin) / walk.direction;
        float nearest = min(leaves.x, min(leaves.y, leaves.z));
        float way = clamp(nearest, walk.t, walk.end) - walk.t;
        if (tau < rate * way) {
            way = min(tau / rate, way);
            walk.t += way;
            walk.least += least * way;
            walk.mean += mean * way;
            walk.most = most;
            walk.rate = rate;
            return true;
        }
        tau = max(tau - rate * way, 0.0);
        walk.t += way;
        walk.least += least * way;
        walk.mean += mean * way;
        if (leaves.x == nearest) {
            walk.cell.x += walk.direction.x > 0.0 ? 1 : -1;
        } else if (leaves.y == nearest) {
            walk.cell.y += walk.direction.y > 0.0 ? 1 : -1;
        } else {
            walk.cell.z += walk.direction.z > 0.0 ? 1 : -1;
        }
        // Rounding may have the last cell end before the box does.
        bool outside = any(lessThan(walk.cell, ivec3(0))) || any(greaterThanEqual(walk.cell, ivec3(grid.cells_x, grid.cells_y, grid.cells_z)));
        walk.end = outside ? walk.t : walk.end;
    }
    return false;
}

// The mean of the cell in which a point of the unit cube lies.
float grid_mean(Grid grid, vec3 local) {
    vec3 cells = vec3(grid.cells_x, grid.cells_y, grid.cells_z);
    return VALUE(cell_numbers(grid, whole(clamp(floor(local * cells), vec3(0.0), cells - 1.0))) + 2u);
}

// Four numbers of a stream.
vec4 stream_numbers(uvec4 key, uint index) {
    return to_unit(pcg4d(uvec4(key.x + index, key.yzw)));
}

// Below this transmittance a shadow ray goes on by chance.
const float FAINT_TRANSMITTANCE = 1e-3;
const float FAINT_DEPTH = 7.0;

// An unbiased estimate of the transmittance between two distances, by residual ratio tracking (Novak et al. 2014): what each cell takes
// away at least is exact, the rest is a product over tentative collisions. Adds to `mean` the optical depth of the cells' means, which
// is a function of the ray alone, and to `index` the numbers that it took from the stream. Where nothing passes, `mean` is only that of a
// part of the way, unless the `whole` is asked for.
vec3 grid_transmittance(Grid grid, vec3 sigma_t, bool whole, vec3 origin, vec3 direction, float t_begin, float t_end, uvec4 key, inout uint index, inout float mean) {
    GridWalk walk = start_grid_walk(grid, origin, direction, t_begin, t_end);
    vec3 passes = vec3(1.0);
    float tau = minus_log_1m(stream_numbers(key, index).x);
    index += 1u;
    [[dont_unroll]] while (walk_to_collision(grid, WALK_RESIDUAL, walk, tau)) {
        vec4 u = stream_numbers(key, index);
        index += 1u;
        vec3 sigma = sigma_t * grid_value(grid, walk_point(grid, walk));
        passes *= clamp((walk.most - sigma) / walk.rate, vec3(0.0), vec3(1.0));
        tau = minus_log_1m(u.x);
        if (max_component(passes) < FAINT_TRANSMITTANCE || walk.least > FAINT_DEPTH) {
            passes = u.y < 0.5 ? vec3(0.0) : 2.0 * passes;
            if (max_component(passes) == 0.0) {
                if (!whole) {
                    break;
                }
                tau = INFINITE_DISTANCE;
            }
        }
    }
    mean += walk.mean;
    return passes * exp_minus(walk.least);
}

// How far a ray gets from where it begins, the density times length of that way, and whether that is what was wanted.
struct DenseWay {
    float way;
    float dense;
    bool ends;
};

// A density's voxels between whose centres a ray goes cell by cell. Around them stands what lies beyond the box, so that no cell lacks a
// voxel. Of voxels without interpolation each is a cell of its own.
struct DenseVoxels {
    uint first;
    uint row;       // voxels to the next one in y
    uint layer;     // in z
    vec3 shift;     // from the unit cube times the size to cells
    ivec3 count;    // of cells
    bool nearest;
};

DenseVoxels dense_voxels(Grid grid) {
    bool nearest = (grid.flags & GRID_NEAREST) != 0u;
    uint more = nearest ? 0u : 2u;
    uint row = grid.size_x + more;
    ivec3 count = ivec3(grid.size_x, grid.size_y, grid.size_z) + (nearest ? 0 : 1);
    return DenseVoxels(grid.first_value, row, row * (grid.size_y + more), vec3(nearest ? 0.0 : 0.5), count, nearest);
}

// The density s after a place of a ray in a cell: a polynomial of s, constant first. The place is `part` of the way through the cell in each
// axis, and moves by `step` per unit of length.
vec4 density_along(DenseVoxels voxels, ivec3 cell, vec3 part, vec3 step) {
    uint at = voxels.first + uint(cell.z) * voxels.layer + uint(cell.y) * voxels.row + uint(cell.x);
    if (voxels.nearest) {
        return vec4(VALUE(at), 0.0, 0.0, 0.0);
    }
    uint up = at + voxels.row, far = at + voxels.layer, corner = far + voxels.row;
    // Along x, of the four rows (near, its neighbour in y, far, its neighbour in y): constant and slope.
    vec4 begin = vec4(VALUE(at), VALUE(up), VALUE(far), VALUE(corner));
    vec4 rise = vec4(VALUE(at + 1u), VALUE(up + 1u), VALUE(far + 1u), VALUE(corner + 1u)) - begin;
    vec4 value = begin + rise * part.x, slope = rise * step.x;
    // In the two planes, quadratic.
    vec2 apart = value.yw - value.xz, turn = slope.yw - slope.xz;
    vec2 c0 = value.xz + apart * part.y, c1 = slope.xz + turn * part.y + apart * step.y, c2 = turn * step.y;
    float d0 = c0.y - c0.x, d1 = c1.y - c1.x, d2 = c2.y - c2.x;
    return vec4(c0.x + d0 * part.z, c1.x + d1 * part.z + d0 * step.z, c2.x + d2 * part.z + d1 * step.z, d2 * step.z);
}

// The integral of such a density from 0 to s.
float length_along(vec4 density, float s) {
    return s * (density.x + s * (density.y * 0.5 + s * (density.z * 0.33333334 + s * (density.w * 0.25))));
}

// Voxels in a block that a ray passes in one step if they are all alike.
const int BLOCK_SHIFT = 2;
const int BLOCK = 1 << BLOCK_SHIFT;

// The way through voxels of one number over which density times length becomes `wanted`, or else all of it. Exact: between voxel centres the
// density along a ray is a polynomial.
DenseWay voxel_way(Grid grid, vec3 origin, vec3 direction, float t_begin, float t_end, float wanted) {
    vec2 clipped = clip_to_grid(grid, origin, direction, t_begin, t_end);
    DenseVoxels voxels = dense_voxels(grid);
    vec3 size = vec3(grid.size_x, grid.size_y, grid.size_z);
    vec3 from = grid_local(grid, origin) * size + voxels.shift;
    vec3 step = away_from_zero(grid_direction(grid, direction) * size);
    vec3 inverse = 1.0 / step;
    bvec3 forward = greaterThan(step, vec3(0.0));
    float t = clipped.x, end = clipped.y, dense = 0.0, way = 0.0;
    ivec3 cell = clamp(ivec3(floor(from + step * min(t, end))), ivec3(0), voxels.count - 1);
    vec4 density = vec4(0.0);
    bool found = false;
    [[dont_unroll]] while (t < end) {
        ivec3 block = cell >> BLOCK_SHIFT;
        float same = VALUE(grid.first_cell + (uint(block.z) * grid.cells_y + uint(block.y)) * grid.cells_x + uint(block.x));
        bool skips = same >= 0.0;
        ivec3 low = skips ? block << BLOCK_SHIFT : cell, high = low + (skips ? BLOCK : 1);
        vec3 leaves = (mix(vec3(low), vec3(high), forward) - from) * inverse;
        float nearest = min(leaves.x, min(leaves.y, leaves.z));
        way = clamp(nearest, t, end) - t;
        density = skips ? vec4(same, 0.0, 0.0, 0.0) : density_along(voxels, cell, from + step * t - vec3(cell), step);
        float more = length_along(density, way);
        found = dense + more >= wanted;
        if (found) {
            break;
        }
        dense += more;
        t += way;
        cell = clamp(ivec3(floor(from + step * t)), low, high - 1);
        if (leaves.x == nearest) {
            cell.x = forward.x ? high.x : low.x - 1;
        } else if (leaves.y == nearest) {
            cell.y = forward.y ? high.y : low.y - 1;
        } else {
            cell.z = forward.z ? high.z : low.z - 1;
        }
        bool outside = any(lessThan(cell, ivec3(0))) || any(greaterThanEqual(cell, voxels.count));
        end = outside ? t : end;
    }
    if (!found) {
        return DenseWay(t_end - t_begin, dense, false);
    }
    // Newton's method, with bisection where it goes astray.
    float left = wanted - dense, low = 0.0, high = way, s = way * min(left / max(length_along(density, way), 1e-37), 1.0);
    [[dont_unroll]] for (uint i = 0u; i < 16u; ++i) {
        float excess = length_along(density, s) - left;
        low = excess < 0.0 ? s : low;
        high = excess < 0.0 ? high : s;
        float here = density.x + s * (density.y + s * (density.z + s * density.w));
        float next = s - excess / max(here, 1e-37);
        next = next >= low && next <= high ? next : 0.5 * (low + high);
        float moved = abs(next - s);
        s = next;
        if (moved <= 1e-6 * way) {
            break;
        }
    }
    return DenseWay(t + s - t_begin, wanted, true);
}

// Density times length, of a density exp(-h) at a height that begins at h >= 0 and changes by slope per unit of length without getting
// below 0: `low` is the lower one of the two ends, slope >= 0.
float length_above(float low, float slope, float way) {
    float change = slope * way;
    return exp_minus(low) * (change > 1e-6 ? one_minus_exp_minus(change) / slope : way);
}

// Density times length between two distances. The density is exp(-h) above the height 0, and 1 below.
float height_length(Grid grid, vec3 origin, vec3 direction, float t_begin, float t_end) {
    float slope = dot(grid.row_x, direction), way = t_end - t_begin;
    float begin = dot(grid.row_x, origin) + grid.shift_x + slope * t_begin;
    float steep = abs(slope);
    // What lies above the height 0 is passed last where the ray goes up, and first where it goes down.
    float below = begin < 0.0 ? (slope > 0.0 ? min(-begin / slope, way) : way) : 0.0;
    float above = slope > 0.0 ? way - below : (begin > 0.0 ? min(begin / max(steep, 1e-30), way) : 0.0);
    below = slope > 0.0 ? below : way - above;
    float low = slope > 0.0 ? max(begin, 0.0) : max(begin - steep * above, 0.0);
    return below + length_above(low, steep, above);
}

// The density at a point.
float height_density(Grid grid, vec3 point) {
    return exp_minus(max(dot(grid.row_x, point) + grid.shift_x, 0.0));
}

// log(1 + x) for x >= 0.
float log_1p(float x) {
    return x < 0.03 ? minus_log_1m_small(x / (1.0 + x)) : minus_log(1.0 / (1.0 + x));
}

// The way from t_begin on over which density times length becomes `wanted`; INFINITE_DISTANCE if it never does.
float height_flight(Grid grid, vec3 origin, vec3 direction, float t_begin, float wanted) {
    float slope = dot(grid.row_x, direction);
    float begin = dot(grid.row_x, origin) + grid.shift_x + slope * t_begin;
    if (slope > 0.0) {
        float below = begin < 0.0 ? min(-begin / slope, INFINITE_DISTANCE) : 0.0;
        if (wanted <= below) {
            return wanted;
        }
        // exp(-low) (1 - exp(-slope s)) / slope = rest
        float part = (wanted - below) * slope / max(exp_minus(max(begin, 0.0)), 1e-37);
        return part < 1.0 ? min(below + minus_log_1m_small(min(part, 0.99999994)) / slope, INFINITE_DISTANCE) : INFINITE_DISTANCE;
    }
    if (begin <= 0.0) {
        return wanted;
    }
    float steep = -slope, thin = exp_minus(begin);
    float above = min(begin / max(steep, 1e-30), INFINITE_DISTANCE);
    // exp(-begin) (exp(steep s) - 1) / steep = wanted
    float part = wanted * steep / max(thin, 1e-37);
    float way = part > 1e-6 ? log_1p(min(part, 1e37)) / max(steep, 1e-30) : min(wanted / max(thin, 1e-30), INFINITE_DISTANCE);
    if (way <= above) {
        return way;
    }
    return above + max(wanted - length_above(0.0, steep, above), 0.0);
}

// Whether a density is one of voxels.
bool is_field(Grid grid) {
    return HAS_FIELDS && (!HAS_HEIGHTS || grid.size_x > 0u);
}

// The way over which density times length becomes `wanted`, or else all of it.
DenseWay dense_way(Grid grid, vec3 origin, vec3 direction, float t_begin, float t_end, float wanted) {
    if (is_field(grid)) {
        return voxel_way(grid, origin, direction, t_begin, t_end, wanted);
    }
    float dense = height_length(grid, origin, direction, t_begin, t_end), way = t_end - t_begin;
    bool ends = wanted < dense;
    if (ends) {
        way = min(height_flight(grid, origin, direction, t_begin, wanted), way);
    }
    return DenseWay(way, ends ? wanted : dense, ends);
}

float density_at(Grid grid, vec3 point) {
    if (is_field(grid)) {
        DenseVoxels voxels = dense_voxels(grid);
        vec3 place = grid_local(grid, point) * vec3(grid.size_x, grid.size_y, grid.size_z) + voxels.shift;
        ivec3 cell = clamp(ivec3(floor(place)), ivec3(0), voxels.count - 1);
        return density_along(voxels, cell, clamp(place - vec3(cell), vec3(0.0), vec3(1.0)), vec3(0.0)).x;
    }
    return height_density(grid, point);
}
