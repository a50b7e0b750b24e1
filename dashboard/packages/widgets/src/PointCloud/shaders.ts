/** The two programs of the cloud's picture: points that colour themselves, and lines of one colour each. */

/** A ramp that reads well on light and dark, from low to high. */
const RAMP = /* glsl */ `
vec3 ramp(float share) {
  const vec3 stops[6] = vec3[6](
    vec3(0.27, 0.35, 0.86), vec3(0.16, 0.60, 0.90), vec3(0.16, 0.75, 0.60),
    vec3(0.55, 0.78, 0.25), vec3(0.96, 0.70, 0.20), vec3(0.90, 0.30, 0.22));
  float at = clamp(share, 0.0, 1.0) * 5.0;
  int low = min(int(at), 4);
  return mix(stops[low], stops[low + 1], at - float(low));
}`

/** `mode`: 0 height, 1 distance, 2 intensity, 3 the points' own colours. */
export const POINT_VERTEX = /* glsl */ `#version 300 es
uniform mat4 view;
uniform vec3 origin;
uniform vec2 span;
uniform int mode;
uniform float size;
layout(location = 0) in vec3 position;
layout(location = 1) in float intensity;
layout(location = 2) in vec3 colour;
out vec3 shown;
${RAMP}
void main() {
  gl_Position = view * vec4(position, 1.0);
  gl_PointSize = size;
  vec3 place = position + origin;
  float value = mode == 0 ? place.z : mode == 1 ? length(place) : intensity;
  shown = mode == 3 ? colour : ramp((value - span.x) / max(span.y - span.x, 1e-6));
}`

export const POINT_FRAGMENT = /* glsl */ `#version 300 es
precision mediump float;
in vec3 shown;
out vec4 pixel;
void main() { pixel = vec4(shown, 1.0); }`

export const LINE_VERTEX = /* glsl */ `#version 300 es
uniform mat4 view;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 colour;
out vec4 shown;
void main() {
  gl_Position = view * vec4(position, 1.0);
  shown = colour;
}`

export const LINE_FRAGMENT = /* glsl */ `#version 300 es
precision mediump float;
in vec4 shown;
out vec4 pixel;
void main() { pixel = vec4(shown.rgb * shown.a, shown.a); }`
