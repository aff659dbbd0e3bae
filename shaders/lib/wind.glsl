// Stage `apply_wind`: drag and lift of the air on a triangle (server/solver/method.md).
#ifndef DRAPE_LIB_WIND_GLSL_
#define DRAPE_LIB_WIND_GLSL_

#include "lib/vector.glsl"

// r - r': the change of a triangle's velocity by the air within a kick. r is the velocity of the air relative to
// the triangle [m/s], `normal` is perpendicular to it and twice its area long [m^2]; drag and lift are duration *
// density of the air * coefficient / (4 * mass of the triangle) [s/m / m^2].
vec3 AirVelocityChange(vec3 r, vec3 normal, float drag, float lift) {
  float twice_area = Length(normal);
  float speed = Length(r);
  if (twice_area == 0.0 || speed == 0.0) return vec3(0.0);
  precise vec3 n = normal / twice_area;
  float approach = Dot(r, n);
  precise float cosine = min(abs(approach) / speed, 1.0);
  precise float sine_sq = 1.0 - cosine * cosine;

  precise float drag_ratio = min(drag * (twice_area * abs(approach)), MAX_AIR_RATIO);
  precise float lift_ratio = min(lift * (twice_area * speed), MAX_AIR_RATIO);
  // Lift turns r away from n, at most to edge-on; drag shortens it.
  precise float turn = lift_ratio * cosine / (1.0 + lift_ratio * sine_sq);
  precise float turn_sq = turn * turn * sine_sq;
  precise float root = sqrt(1.0 + turn_sq);
  // r - r' without the difference of nearly equal numbers.
  precise float keep = 1.0 / (1.0 + drag_ratio);
  precise float shrink = keep * (drag_ratio + turn_sq / (root * (1.0 + root)));
  precise float along_n = keep * turn / root * (approach < 0.0 ? -speed : speed);
  precise float along_r = shrink - keep * turn / root * cosine;
  precise vec3 change = along_r * r + along_n * n;
  return change;
}

#endif
