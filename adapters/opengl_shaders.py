"""The GLSL of the OpenGL child: the scene contract's reflection model, and depth peeling for transparent surfaces.

``#define LIGHTS`` and ``#define PEEL`` are put in front by the child: numbers only, nothing that a scene says.
"""

from __future__ import annotations

LIGHT = """
const float PI = 3.14159265358979;
uniform vec3 eye;
uniform bool distant[LIGHTS];
uniform vec3 place[LIGHTS]; // of a point light; towards a distant one
uniform vec3 power[LIGHTS];
uniform int lights;
uniform bool gouraud; // light the corners and interpolate the colours
uniform float exponent;
uniform int lobe; // 0 none, 1 Phong, 2 Blinn, 3 and 4 the same times N.L
// pow() is exact to 12 bits or so; whole exponents, which are most, can do better.
float raised(float x, float n) {
    if (n != floor(n) || n > 65535.0) return pow(x, n);
    float result = 1.0;
    for (int k = int(n); k > 0; k >>= 1) {
        if ((k & 1) == 1) result *= x;
        x *= x;
    }
    return result;
}

// The light that P sends to the viewer, apart from the colours: diffuse, and the highlight. N is of unit length.
void lit(vec3 P, vec3 N, out vec3 even, out vec3 shine) {
    vec3 V = normalize(eye - P);
    even = shine = vec3(0.0);
    for (int k = 0; k < lights; ++k) {
        vec3 to = distant[k] ? place[k] : place[k] - P;
        float square = dot(to, to);
        vec3 L = to / sqrt(square);
        vec3 E = (distant[k] ? power[k] : power[k] / square) / PI;
        float NL = dot(N, L);
        if (NL <= 0.0) continue;
        even += E * NL;
        if (lobe != 0) {
            float cosine = (lobe & 1) == 1 ? 2.0 * NL * dot(N, V) - dot(L, V) : dot(N, normalize(L + V));
            float highlight = cosine > 0.0 ? raised(cosine, exponent) : 0.0;
            shine += E * (lobe > 2 ? highlight * NL : highlight);
        }
    }
}
"""

VERTEX = """
uniform mat4 view;
uniform mat4 projection;
in vec3 position;
in vec3 normal;
in vec2 uv;
out vec3 P;
out vec3 N_raw;
out vec2 st;
out vec3 corner_even[2]; // seen from in front, and from behind
out vec3 corner_shine[2];
void main() {
    P = position;
    N_raw = normal;
    st = uv;
    for (int side = 0; gouraud && side < 2; ++side)
        lit(P, normalize(side == 0 ? N_raw : -N_raw), corner_even[side], corner_shine[side]);
    gl_Position = projection * (view * vec4(position, 1.0));
}
"""

FRAGMENT = """
uniform vec3 diffuse;
uniform vec3 specular;
uniform float opacity;
uniform bool textured;
uniform ivec2 wrap; // of u and v: 0 repeats, 1 is clamped, 2 is mirrored, 3 ends in black
uniform sampler2D texels; // row 0 at v = 1
in vec3 P;
in vec3 N_raw;
in vec2 st;
in vec3 corner_even[2];
in vec3 corner_shine[2];
layout(location = 0) out vec4 radiance;
#if PEEL
uniform sampler2D before; // of the layer in front: depth, number of the triangle, drawn or not
uniform bool first_layer;
uniform int first_triangle;
uniform float steps; // of a fixed-point depth buffer; 0: floating point; -1: reversed
layout(location = 1) out vec4 key;
#endif

int wrapped(int i, int n, int how) {
    if (how == 1) return clamp(i, 0, n - 1);
    if (how == 3) return i < 0 || i >= n ? -1 : i;
    int period = how == 2 ? 2 * n : n;
    i -= period * int(floor(float(i) / float(period)));
    return i < n ? i : period - 1 - i;
}

vec3 texel(int x, int y) {
    ivec2 n = textureSize(texels, 0);
    ivec2 at = ivec2(wrapped(x, n.x, wrap.x), wrapped(y, n.y, wrap.y));
    return at.x < 0 || at.y < 0 ? vec3(0.0) : texelFetch(texels, at, 0).rgb;
}

// The samplers of real hardware interpolate with weights of 8 bits; these are exact.
vec3 bilinear(vec2 uv) {
    vec2 at = vec2(uv.x, 1.0 - uv.y) * vec2(textureSize(texels, 0)) - 0.5;
    vec2 whole = floor(at), f = at - whole;
    int x = int(whole.x), y = int(whole.y);
    return mix(mix(texel(x, y), texel(x + 1, y), f.x), mix(texel(x, y + 1), texel(x + 1, y + 1), f.x), f.y);
}

void main() {
#if PEEL
    float depth = steps > 0.0 ? roundEven(gl_FragCoord.z * steps) : steps < 0.0 ? -gl_FragCoord.z : gl_FragCoord.z;
    float number = float(first_triangle + gl_PrimitiveID);
    if (!first_layer) {
        vec3 front = texelFetch(before, ivec2(gl_FragCoord.xy), 0).xyz;
        if (front.z == 0.0 || depth < front.x || (depth == front.x && number <= front.y)) discard;
    }
    key = vec4(depth, number, 1.0, 0.0);
#endif
    vec3 even, shine;
    if (gouraud) {
        even = corner_even[gl_FrontFacing ? 0 : 1];
        shine = corner_shine[gl_FrontFacing ? 0 : 1];
    } else {
        lit(P, normalize(gl_FrontFacing ? N_raw : -N_raw), even, shine);
    }
    radiance = vec4((textured ? bilinear(st) : diffuse) * even + specular * shine, opacity);
}
"""
