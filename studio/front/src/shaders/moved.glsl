// As `move_by_shares` of the library: each vertex moves by its share of each motion, a rotation
// by exp(share * log r) (Rodrigues' formula), so a twist does not pinch. `blend` fades to `exact`,
// the result of the server.
#define REGIONS 4
// TURNING is defined while a region rotates, BLENDING while the exact result is seen: in software,
// what is not needed takes a fifth of a frame also behind a branch that is not taken.
#ifdef MOVING
in vec4 shares;
uniform int n_moving;            // regions beyond are at rest
uniform int kind[REGIONS];       // 0: at rest, 1: rotation, 2: translation, 3: scaling
uniform vec3 pivot[REGIONS];
uniform vec3 direction[REGIONS]; // unit axis, vector of the translation, or factors less 1
uniform float angle[REGIONS];
#ifdef BLENDING
in vec3 exact;
in vec3 exact_normal;
uniform float blend;
#endif

const float PI = 3.14159265;

// Errors of the sine of a graphics card are 2e-5 and more; those of this series are below 1e-6.
float sine(float x) {
  float turns = round(x / PI);
  float y = x - turns * PI;
  float q = y * y;
  y *= 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0 * (1.0 - q / 110.0))));
  return mod(turns, 2.0) == 0.0 ? y : -y;
}

vec3 across(vec3 axis, float angle, vec3 arm) {
  vec3 side = cross(axis, arm);
  float half_sine = sine(0.5 * angle);
  return sine(angle) * side + 2.0 * half_sine * half_sine * cross(axis, side);
}

// The position of this vertex; its normal turns by the sum of its shares of the rotations.
vec3 moved(out vec3 turn) {
  vec3 place = position;
  turn = vec3(0.0);
  for (int r = 0; r < n_moving; r++) {
#ifdef TURNING
    if (kind[r] == 1) {
      place += across(direction[r], shares[r] * angle[r], position - pivot[r]);
      turn += shares[r] * angle[r] * direction[r];
    }
#endif
    if (kind[r] == 2) {
      place += shares[r] * direction[r];
    } else if (kind[r] == 3) {
      place += shares[r] * direction[r] * (position - pivot[r]);
    }
  }
#ifdef BLENDING
  place = mix(place, exact, blend);
#endif
  return place;
}

vec3 turned(vec3 vector, vec3 turn) {
  float size = max(length(turn), 1e-20);
  return vector + across(turn / size, size, vector);
}

// The normal of this vertex, after the turn of `moved`.
vec3 moved_normal(vec3 turn) {
  vec3 there = normal;
#ifdef TURNING
  there = turned(normal, turn);
#endif
#ifdef BLENDING
  there = mix(there, exact_normal, blend);
#endif
  return there;
}
#else
vec3 moved(out vec3 turn) {
  turn = vec3(0.0);
  return position;
}

vec3 moved_normal(vec3 turn) {
  return normal;
}
#endif
