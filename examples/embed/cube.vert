#version 460
// A cube without vertex buffers: 36 vertices, six for each face.

layout(push_constant) uniform Cube {
    mat4 clip_from_relative;
    // Centre relative to the eye, and half the side, metres.
    vec4 centre_half;
    vec4 colour;
};

layout(location = 0) out vec3 out_colour;

void main() {
    const vec2 CORNERS[6] = vec2[](vec2(-1, -1), vec2(1, -1), vec2(1, 1), vec2(-1, -1), vec2(1, 1), vec2(-1, 1));
    const vec3 TOWARDS_SUN = vec3(-0.71, 0.57, -0.41);
    int face = gl_VertexIndex / 6;
    int axis = face % 3;
    float side = face < 3 ? 1.0 : -1.0;
    vec2 corner = CORNERS[gl_VertexIndex % 6];
    vec3 normal = vec3(0.0);
    normal[axis] = side;
    vec3 at = normal;
    at[(axis + 1) % 3] = corner.x;
    at[(axis + 2) % 3] = corner.y;
    gl_Position = clip_from_relative * vec4(centre_half.xyz + centre_half.w * at, 1.0);
    out_colour = colour.rgb * (0.3 + 0.7 * max(dot(normal, TOWARDS_SUN), 0.0));
}
