// Stages `solve_contacts` and `correct_velocity`: distances interpolated between samples on a grid of cubic
// cells (Bender et al. 2009, section 4.1; server/scene/distance_map.h).
#ifndef DRAPE_LIB_DISTANCE_MAP_GLSL_
#define DRAPE_LIB_DISTANCE_MAP_GLSL_

#include "lib/vector.glsl"

struct DistanceGrid {
  uvec3 sample_counts;  // each >= 2
  float cell;           // [m]
  float inverse_cell;   // [1/m]
  uint samples;         // where they are, x fastest
};

// The place of a point in a grid.
struct MapPlace {
  uvec3 cell;
  vec3 fraction;  // of the cell, 0 to 1
  vec3 outside;   // from the nearest point of the grid's box to the point [m]
};

// The samples around a cell [m]: xy of each layer, x fastest.
struct CellCorners {
  vec4 near_z;
  vec4 far_z;
};

struct MapDistance {
  float distance;  // [m]
  vec3 gradient;   // by metres [-]; not a unit vector
};

// `from_corner`: from the first sample, in the world's directions [m]. NaN counts as 0, so that the cell is always one
// of the grid's; it stays in `outside`.
MapPlace PlaceInMap(DistanceGrid grid, mat3 axes, vec3 from_corner) {
  precise vec3 in_cells = vec3(Dot(from_corner, axes[0]), Dot(from_corner, axes[1]),
                               Dot(from_corner, axes[2])) * grid.inverse_cell;
  vec3 last = vec3(grid.sample_counts - 1u);
  vec3 not_below = vec3(in_cells.x > 0.0 ? in_cells.x : 0.0, in_cells.y > 0.0 ? in_cells.y : 0.0,
                        in_cells.z > 0.0 ? in_cells.z : 0.0);
  vec3 clamped = min(not_below, last);
  MapPlace place;
  place.cell = min(uvec3(clamped), grid.sample_counts - 2u);
  precise vec3 fraction = clamped - vec3(place.cell);
  precise vec3 outside = (in_cells - clamped) * grid.cell;
  place.fraction = fraction;
  place.outside = outside;
  return place;
}

float Between(float a, float b, float t) {
  precise float value = a + t * (b - a);
  return value;
}

// Over a square: xy at one end of the second direction, zw at the other.
float Bilinear(vec4 values, float s, float t) {
  return Between(Between(values.x, values.y, s), Between(values.z, values.w, s), t);
}

// The trilinear interpolation and its gradient; outside the grid the root of the squares of the way to its
// box and of the distance there, which is no more than the distance.
MapDistance DistanceInMap(DistanceGrid grid, MapPlace place, CellCorners corners) {
  vec3 f = place.fraction;
  vec4 a = corners.near_z;
  vec4 b = corners.far_z;
  precise vec4 along_x = vec4(a.yw - a.xz, b.yw - b.xz);
  precise vec4 along_y = vec4(a.zw - a.xy, b.zw - b.xy);
  precise vec4 along_z = b - a;
  precise vec3 gradient = vec3(Bilinear(along_x, f.y, f.z), Bilinear(along_y, f.x, f.z),
                               Bilinear(along_z, f.x, f.y)) * grid.inverse_cell;
  MapDistance map;
  map.distance = Between(Bilinear(a, f.x, f.y), Bilinear(b, f.x, f.y), f.z);
  map.gradient = gradient;
  float outside_sq = Dot(place.outside, place.outside);
  if (outside_sq != 0.0) {
    precise float distance = sqrt(map.distance * map.distance + outside_sq);
    // The box's nearest point moves along only where the point is within.
    precise vec3 inner = map.distance * gradient;
    precise vec3 outer_gradient = mix(place.outside, inner, equal(place.outside, vec3(0.0))) / distance;
    map.distance = distance;
    map.gradient = outer_gradient;
  }
  return map;
}

#endif
