// Colours that depend on the place on a surface, by texture coordinates (u, v): (0, 0) is the upper left of an image, and the centres of
// its pixels are at ((x + 1/2)/width, (y + 1/2)/height). Linear sRGB. Pixels are read by VALUE(i), which the kernel declares.
#include "lib/constants.glsl"

// A coordinate moved to [-1/2, 5/2] without moving to another pixel, so that the index of the pixel is a small number: by whole
// images where they repeat, by two where every other one is mirrored.
float wrapped_coordinate(float x, uint flags) {
    if ((flags & TEXTURE_CLAMP) != 0u) {
        return clamp(x, -0.5, 1.5);
    }
    return (flags & TEXTURE_MIRROR) != 0u ? x - 2.0 * floor(0.5 * x) : x - floor(x);
}

// The pixel of an index that may lie outside of the image by as much as wrapped_coordinate leaves.
uint wrapped_index(int index, uint size, uint flags) {
    int count = int(size);
    if ((flags & TEXTURE_CLAMP) != 0u) {
        return uint(clamp(index, 0, count - 1));
    }
    int period = (flags & TEXTURE_MIRROR) != 0u ? 2 * count : count;
    index = index < 0 ? index + period : index;
    index = index >= period ? index - period : index;
    return uint(index < count ? index : period - 1 - index);
}

vec3 texture_pixel(Texture texture, int x, int y) {
    uint column = wrapped_index(x, texture.width, texture.flags), row = wrapped_index(y, texture.height, texture.flags);
    uint first = texture.first_value + 3u * (row * texture.width + column);
    return vec3(VALUE(first), VALUE(first + 1u), VALUE(first + 2u));
}

vec3 eval_texture(Texture texture, vec2 uv) {
    vec2 place = vec2(dot(texture.row_u, vec3(uv, 1.0)), dot(texture.row_v, vec3(uv, 1.0)));
    if (texture.kind == TEXTURE_CHECKERBOARD) {
        bvec2 above = greaterThan(place - floor(place), vec2(0.5));
        return above.x == above.y ? texture.color_0 : texture.color_1;
    }
    place = vec2(wrapped_coordinate(place.x, texture.flags), wrapped_coordinate(place.y, texture.flags));
    place *= vec2(texture.width, texture.height);
    if ((texture.flags & TEXTURE_NEAREST) != 0u) {
        return texture_pixel(texture, int(floor(place.x)), int(floor(place.y)));
    }
    vec2 low = floor(place - 0.5), share = place - 0.5 - low;
    int x = int(low.x), y = int(low.y);
    vec3 upper = mix(texture_pixel(texture, x, y), texture_pixel(texture, x + 1, y), share.x);
    vec3 lower = mix(texture_pixel(texture, x, y + 1), texture_pixel(texture, x + 1, y + 1), share.x);
    return mix(upper, lower, share.y);
}

// The numbers that a mesh has at a place on one of its triangles, which have blocks of 2 x 2 pixels in rows: those of the corners first.
vec3 eval_attribute(Texture texture, uint triangle, vec2 barycentric) {
    uint columns = texture.width / 2u, row = triangle / columns;
    int x = int(2u * (triangle - row * columns)), y = int(2u * row);
    vec3 a = texture_pixel(texture, x, y);
    return a + (texture_pixel(texture, x + 1, y) - a) * barycentric.x + (texture_pixel(texture, x, y + 1) - a) * barycentric.y;
}

// The gradient of the first channel of an image with bilinear filter, with respect to (u, v); 0 for what is no image.
vec2 texture_gradient(Texture texture, vec2 uv) {
    if (texture.kind != TEXTURE_BITMAP) {
        return vec2(0.0);
    }
    vec2 place = vec2(dot(texture.row_u, vec3(uv, 1.0)), dot(texture.row_v, vec3(uv, 1.0)));
    place = vec2(wrapped_coordinate(place.x, texture.flags), wrapped_coordinate(place.y, texture.flags));
    place *= vec2(texture.width, texture.height);
    vec2 low = floor(place - 0.5), share = place - 0.5 - low;
    int x = int(low.x), y = int(low.y);
    float f00 = texture_pixel(texture, x, y).x, f10 = texture_pixel(texture, x + 1, y).x;
    float f01 = texture_pixel(texture, x, y + 1).x, f11 = texture_pixel(texture, x + 1, y + 1).x;
    vec2 slope = vec2(mix(f10 - f00, f11 - f01, share.y), mix(f01 - f00, f11 - f10, share.x)) * vec2(texture.width, texture.height);
    return texture.row_u.xy * slope.x + texture.row_v.xy * slope.y;
}
