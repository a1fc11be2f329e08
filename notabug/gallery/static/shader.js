"use strict";
// The shader of the viewer: everything that is seen of float pictures is computed here, from their own values.
const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0), 0.0, 1.0); }`;
const FRAGMENT = `#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D A, B, M;
uniform vec2 size, canvas, pane, origin;
uniform float zoom, wipe, exposure;
uniform int mode, second, measure, mapped, tone, channel;
out vec4 colour;
const vec3 GROUND = vec3(0.094);
const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722); // Rec. 709

vec3 magma(float t) { // a polynomial through matplotlib's colour map
  t = clamp(t, 0.0, 1.0);
  return clamp(vec3(-0.0021365, -0.0007497, -0.0053861) + t * (vec3(0.2516605, 0.6775232, 2.4940266)
    + t * (vec3(8.3537173, -3.5777195, 0.3144679) + t * (vec3(-27.668733, 14.2647308, -13.6492132)
    + t * (vec3(52.1761398, -27.9436061, 12.9441694) + t * (vec3(-50.7685254, 29.0465828, 4.2341530)
    + t * vec3(18.6556705, -11.4897735, -5.6019615)))))), 0.0, 1.0);
}
float most(vec3 v) { return max(v.r, max(v.g, v.b)); }
vec3 encode(vec3 v) { return mix(12.92 * v, 1.055 * pow(max(v, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, v)); }
vec3 toned(vec3 v) {
  if (tone == 1) return clamp(v, 0.0, 1.0);
  if (tone == 2) return pow(clamp(v, 0.0, 1.0), vec3(1.0 / 2.2));
  if (tone == 3) return encode(max(v, 0.0) / (1.0 + max(v, 0.0)));
  if (tone == 4) return magma((log2(max(dot(v, LUMINANCE), 1e-6)) + 10.0) / 12.0);
  return encode(clamp(v, 0.0, 1.0));
}
vec3 picked(vec4 v) {
  if (channel == 1) return v.rrr;
  if (channel == 2) return v.ggg;
  if (channel == 3) return v.bbb;
  if (channel == 4) return v.aaa;
  if (channel == 5) return vec3(dot(v.rgb, LUMINANCE));
  return v.rgb;
}
bool broken(vec3 v) { return any(isnan(v)) || any(isinf(v)); }
vec3 difference(vec4 a, vec4 b, float m) {
  vec3 p = picked(a), q = picked(b), d = q - p;
  if (measure == 0) return toned(abs(d) * exposure);
  if (measure == 1) {
    float s = clamp(4.0 * exposure * (d.r + d.g + d.b) / 3.0, -1.0, 1.0);
    vec3 end = s > 0.0 ? vec3(0.94, 0.36, 0.27) : vec3(0.26, 0.56, 0.93);
    return mix(vec3(0.16), end, pow(abs(s), 0.6));
  }
  if (measure == 2) return magma(most(abs(d) / (max(abs(p), abs(q)) + 1e-3)) * exposure);
  if (measure == 4) return mapped == 1 ? magma(0.1 * exposure * most(abs(d)) / max(m, 1e-9)) : vec3(0.0);
  if (measure == 7) return mix(0.35 * toned(p), vec3(0.44, 0.76, 0.87), 0.75 * m);
  return magma(m * exposure);
}
void main() {
  vec2 p = vec2(gl_FragCoord.x, canvas.y - gl_FragCoord.y);
  float across = p.x / canvas.x;
  bvec2 second_half = mode == 0 ? greaterThanEqual(p, pane) : bvec2(false);
  bool right = any(second_half);
  p -= pane * vec2(second_half);
  vec2 q = floor((p - origin) / zoom);
  if (any(lessThan(q, vec2(0.0))) || any(greaterThanEqual(q, size))) { colour = vec4(GROUND, 1.0); return; }
  ivec2 at = ivec2(q);
  vec4 a = texelFetch(A, at, 0), b = texelFetch(B, at, 0);
  bool other = right || (mode == 1 && across >= wipe) || (mode == 2 && second == 1);
  vec4 v = other ? b : a;
  if (mode == 3 ? broken(a.rgb) || broken(b.rgb) : broken(v.rgb)) colour = vec4(1.0, 0.0, 1.0, 1.0);
  else if (mode == 3) colour = vec4(difference(a, b, texelFetch(M, at, 0).r), 1.0);
  else colour = vec4(toned(channel == 4 ? picked(v) : picked(v) * exposure), 1.0);
}`;
