//! Mirror of `shaders/lib/path_share.glsl`: what neighbouring pixels learn from a path.

use super::bindings::Tables;
use super::math::exp_minus_rgb;
use super::medium::channel_weights;
use super::path_state::{Hit, NONE, Path, medium_at};
use super::path_vertex::Vertex;
use super::phase::eval_henyey_greenstein;
use crate::pack::layout::*;
use glam::DVec3;
use std::f64::consts::PI;

#[derive(Clone, Copy, Debug, Default)]
pub struct End {
    pub kind: u32, // 0 none, 1 surface, 2 medium
    pub point: DVec3,
    pub axis: DVec3,
    pub medium: u32,
    pub offset: f64,
    pub left: u32,
}

#[derive(Clone, Copy, Debug, Default)]
pub struct Handed {
    pub first: End,
    pub weight: DVec3,
    pub second: End,
    pub base: DVec3,
    pub ended: DVec3,
    pub light: DVec3,
    pub light_direction: DVec3,
    pub rest: DVec3,
    pub rest_direction: DVec3,
}

pub fn can_share(tables: &Tables, path: &Path, vertex: &Vertex) -> bool {
    if vertex.in_medium {
        return vertex.phase == 0;
    }
    let _ = (tables, path);
    vertex.surface.flags >> SURFACE_KIND_SHIFT == BSDF_DIFFUSE
        && vertex.surface.flags & SURFACE_SMOOTH == 0
        && vertex.surface.relief_texture == 0
}

pub fn end_of(path: &Path, vertex: &Vertex) -> End {
    End {
        kind: if vertex.in_medium { 2 } else { 1 },
        point: vertex.point,
        axis: vertex.axis,
        medium: path.medium,
        offset: path.offset,
        left: path.left,
    }
}

fn scatter_pdf(tables: &Tables, end: &End, direction: DVec3) -> f64 {
    if end.kind == 2 {
        eval_henyey_greenstein(medium_at(tables, end.medium).g, end.axis, direction)
    } else {
        end.axis.dot(direction).max(0.0) / PI
    }
}

/// Density (gray) and its vector form of the second vertex of `j` by the first of `i`.
pub fn connect(tables: &Tables, i: &Handed, j: &Handed) -> DVec3 {
    let a = i.first.point;
    let side = |end: &End, d: DVec3| end.point + end.axis * if end.kind == 1 { end.offset * d.dot(end.axis).signum() } else { 0.0 };
    let d0 = (j.second.point - a).normalize();
    let origin = side(&i.first, d0);
    let target = side(&j.second, -d0);
    let way = target - origin;
    let far = way.length();
    let direction = way / far;
    let pdf = scatter_pdf(tables, &i.first, direction);
    let cosine = if j.second.kind == 1 { -direction.dot(j.second.axis) } else { 1.0 };
    if pdf <= 0.0 || cosine <= 0.0 {
        return DVec3::ZERO;
    }
    let mut path = Path {
        origin,
        direction,
        t_max: far,
        t_min: 0.0,
        last: NONE,
        shadow: true,
        light: NONE - 1,
        light_medium: i.first.medium,
        left: i.first.left,
        ..Path::default()
    };
    path.point = a;
    let hit: Hit = super::traverse(tables, &path);
    if hit.blocked {
        return DVec3::ZERO;
    }
    let sigma = if j.second.kind == 2 { medium_at(tables, j.second.medium).sigma_t } else { DVec3::ONE };
    exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO)) * sigma * (pdf * cosine / (far * far))
}

/// What the second vertex of `j` sends in a direction, in parts: by light sampling and ended; and the rest with density factor.
pub fn sent(tables: &Tables, j: &Handed, from: DVec3) -> (DVec3, DVec3, f64) {
    let arriving = (j.second.point - from).normalize();
    if j.second.kind == 1 {
        return (j.ended + j.light, j.rest, 1.0);
    }
    let g = medium_at(tables, j.second.medium).g;
    if g == 0.0 {
        return (j.ended + j.light, j.rest, 1.0);
    }
    let phase = |axis: DVec3, d: DVec3| eval_henyey_greenstein(g, axis, d);
    let own = j.second.axis;
    let light = if j.light == DVec3::ZERO { DVec3::ZERO } else { j.light * phase(arriving, j.light_direction) / phase(own, j.light_direction) };
    // rest = L · albedo with density phase(own)
    let dens = if j.rest == DVec3::ZERO { 1.0 } else { phase(arriving, j.rest_direction) };
    (j.ended + light, j.rest, dens)
}

/// The samples of a group.
pub fn combine(tables: &Tables, group: &[Handed]) -> Vec<DVec3> {
    let n = group.len();
    let mut p = vec![vec![DVec3::ZERO; n]; n];
    for i in 0..n {
        for j in 0..n {
            if group[i].first.kind != 0 && group[j].second.kind != 0 {
                p[i][j] = connect(tables, &group[i], &group[j]);
            }
        }
    }
    let mean = |i: usize, v: DVec3| if v == DVec3::ZERO { 0.0 } else { channel_weights(group[i].weight).dot(v) };
    (0..n)
        .map(|i| {
            let mut sum = DVec3::ZERO;
            for j in 0..n {
                if p[i][j] == DVec3::ZERO { continue; }
                let nee: f64 = (0..n).map(|k| mean(k, p[k][j])).sum();
                let (light, rest, dens) = sent(tables, &group[j], group[i].first.point);
                let cont: f64 = (0..n).map(|k| if p[k][j] == DVec3::ZERO { 0.0 } else { mean(k, p[k][j]) * sent(tables, &group[j], group[k].first.point).2 }).sum();
                sum += p[i][j] * (light / nee + rest * dens / cont.max(1e-300));
            }
            sum * group[i].weight
        })
        .collect()
}
