// Hashed random numbers: pure functions of their arguments.

// Four hashes of four words: pcg4d (Jarzynski and Olano 2020).
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// The upper 24 bits as a number in [0, 1 - 2^-24].
vec4 to_unit(uvec4 v) {
    return vec4(v >> 8u) * (1.0 / 16777216.0);
}
