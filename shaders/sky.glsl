// Colour of the clear sky in a direction; fog fades to it.

vec3 sky(vec3 direction) {
    float up = clamp(direction.y, 0.0, 1.0);
    vec3 colour = mix(vec3(0.62, 0.73, 0.86), vec3(0.13, 0.29, 0.60), pow(up, 0.55));
    float glow = max(dot(direction, frame.lighting.sun), 0.0);
    return colour + vec3(1.0, 0.8, 0.55) * (0.18 * pow(glow, 12.0) + 4.0 * pow(glow, 1500.0));
}
