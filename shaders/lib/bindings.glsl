// The tables of the scene and the buffers of the kernel: by address where the device can (lavapipe gathers these with vector
// loads), else as storage buffers. Both forms have the same descriptors and the same push constants. Nodes and primitives,
// which every step of a traversal loads, come in words of 64 bits: half as many gathers. naga, which checks the second form,
// knows no storage buffers that are only written.
#include "lib/layout.glsl"
#include "lib/features.glsl"

#ifdef USE_BUFFER_REFERENCE
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
layout(buffer_reference, std430, buffer_reference_align = 8) readonly buffer NodesAddress { uint64_t at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PrimitivesAddress { u64vec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer SurfacesAddress { Surface at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer MediaAddress { Medium at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LightsAddress { Light at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PointsAddress { uvec2 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PhasesAddress { Phase at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer CornersAddress { Corners at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer TexturesAddress { Texture at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer ValuesAddress { float at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer GridsAddress { Grid at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) buffer SamplesAddress { vec4 at[]; };
layout(push_constant) uniform Push {
    NodesAddress nodes;
    PrimitivesAddress primitives;
    SurfacesAddress surfaces;
    MediaAddress media;
    LightsAddress lights;
    PointsAddress points;
    PhasesAddress phases;
    CornersAddress corners;
    TexturesAddress textures;
    ValuesAddress values;
    GridsAddress grids;
    SamplesAddress samples;
    Dispatch work;
} push;
uvec4 load_words(u64vec2 words) {
    return uvec4(unpack32(words.x), unpack32(words.y));
}
Primitive load_primitive(uint i) {
    uvec4 a = load_words(push.primitives.at[3u * i]);
    uvec4 b = load_words(push.primitives.at[3u * i + 1u]);
    uvec4 c = load_words(push.primitives.at[3u * i + 2u]);
    return Primitive(uintBitsToFloat(a.xyz), a.w, uintBitsToFloat(b.xyz), b.w, uintBitsToFloat(c.xyz), uintBitsToFloat(c.w));
}
#define NODE_WORDS(i) unpack32(push.nodes.at[i])
#define PRIMITIVE(i) load_primitive(i)
#define SURFACE(i) push.surfaces.at[i]
#define MEDIUM(i) push.media.at[i]
#define LIGHT(i) push.lights.at[i]
#define POINT(i) push.points.at[i]
#define PHASE(i) push.phases.at[i]
#define CORNERS(i) push.corners.at[i]
#define TEXTURE(i) push.textures.at[i]
#define VALUE(i) push.values.at[i]
#define GRID(i) push.grids.at[i]
#define SAMPLE(i) push.samples.at[i]
layout(buffer_reference, std430, buffer_reference_align = 16) writeonly buffer SampleWordsAddress { u64vec2 at[]; };
void store_sample(uint i, vec4 v) {
    uvec4 bits = floatBitsToUint(v);
    SampleWordsAddress(push.samples).at[i] = u64vec2(pack64(bits.xy), pack64(bits.zw));
}
#else
layout(set = 0, binding = 0, std430) readonly buffer Nodes { uvec2 nodes[]; };
layout(set = 0, binding = 1, std430) readonly buffer Primitives { Primitive primitives[]; };
layout(set = 0, binding = 2, std430) readonly buffer Surfaces { Surface surfaces[]; };
layout(set = 0, binding = 3, std430) readonly buffer Media { Medium media[]; };
layout(set = 0, binding = 4, std430) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 5, std430) readonly buffer Points { uvec2 points[]; };
layout(set = 0, binding = 6, std430) readonly buffer Phases { Phase phases[]; };
layout(set = 0, binding = 7, std430) readonly buffer CornersOfAll { Corners corners[]; };
layout(set = 0, binding = 8, std430) readonly buffer Textures { Texture textures[]; };
layout(set = 0, binding = 9, std430) readonly buffer Values { float values[]; };
layout(set = 0, binding = 10, std430) readonly buffer Grids { Grid grids[]; };
layout(set = 0, binding = 11, std430) buffer Samples { vec4 samples[]; };
layout(push_constant) uniform Push {
    uvec4 addresses[6];
    Dispatch work;
} push;
#define NODE_WORDS(i) nodes[i]
#define PRIMITIVE(i) primitives[i]
#define SURFACE(i) surfaces[i]
#define MEDIUM(i) media[i]
#define LIGHT(i) lights[i]
#define POINT(i) points[i]
#define PHASE(i) phases[i]
#define CORNERS(i) corners[i]
#define TEXTURE(i) textures[i]
#define VALUE(i) values[i]
#define GRID(i) grids[i]
#define SAMPLE(i) samples[i]
void store_sample(uint i, vec4 v) {
    samples[i] = v;
}
#endif
layout(set = 0, binding = 12, std430) readonly buffer ParamsBuffer { Params params; };
