// The tables of the scene and the buffers of the kernel: by address where the device can (lavapipe gathers these with vector
// loads), else as storage buffers. Both forms have the same descriptors and the same push constants. naga, which checks the second,
// knows no storage buffers that are only written.
#include "lib/layout.glsl"
#include "lib/features.glsl"

#ifdef USE_BUFFER_REFERENCE
#extension GL_EXT_buffer_reference : require
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer NodesAddress { uvec4 at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer PrimitivesAddress { Primitive at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer SurfacesAddress { Surface at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer MediaAddress { Medium at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer LightsAddress { Light at[]; };
layout(buffer_reference, std430, buffer_reference_align = 16) writeonly buffer SamplesAddress { vec4 at[]; };
layout(push_constant) uniform Push {
    NodesAddress nodes;
    PrimitivesAddress primitives;
    SurfacesAddress surfaces;
    MediaAddress media;
    LightsAddress lights;
    SamplesAddress samples;
    Dispatch work;
} push;
#define NODE(i) push.nodes.at[i]
#define PRIMITIVE(i) push.primitives.at[i]
#define SURFACE(i) push.surfaces.at[i]
#define MEDIUM(i) push.media.at[i]
#define LIGHT(i) push.lights.at[i]
#define SAMPLE(i) push.samples.at[i]
#else
layout(set = 0, binding = 0, std430) readonly buffer Nodes { uvec4 nodes[]; };
layout(set = 0, binding = 1, std430) readonly buffer Primitives { Primitive primitives[]; };
layout(set = 0, binding = 2, std430) readonly buffer Surfaces { Surface surfaces[]; };
layout(set = 0, binding = 3, std430) readonly buffer Media { Medium media[]; };
layout(set = 0, binding = 4, std430) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 5, std430) buffer Samples { vec4 samples[]; };
layout(push_constant) uniform Push {
    uvec4 addresses[3];
    Dispatch work;
} push;
#define NODE(i) nodes[i]
#define PRIMITIVE(i) primitives[i]
#define SURFACE(i) surfaces[i]
#define MEDIUM(i) media[i]
#define LIGHT(i) lights[i]
#define SAMPLE(i) samples[i]
#endif
layout(set = 0, binding = 6, std430) readonly buffer ParamsBuffer { Params params; };
