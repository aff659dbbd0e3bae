// The data of a picture for the drawing shaders. Positions are in world axes with the origin at the
// eye [m], so that single precision is finest near the viewer. Offsets count 4-byte words
// (elements, for Shaded) from the start of the named block.
#ifndef DRAPE_SHADERS_INTERFACE_DRAW_RECORDS_H_
#define DRAPE_SHADERS_INTERFACE_DRAW_RECORDS_H_

#include "shaders/interface/draw_bindings.h"
#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// The uniform block of a pass. Only members of 16 bytes, so that std140 and C++ agree.
struct DrawFrame {
  mat4 clip_from_world;    // depth from 0 to 1
  mat4 shadow_from_world;  // xyz in 0..1: texture coordinates and depth seen from the key light
  vec4 viewer;             // w = 1: where the viewer is; w = 0: the direction to it
  vec4 to_light;           // unit; w: metres per texel of the shadow map
  vec4 screen;       // width, height [px]; metres per pixel at 1 m; 1 / texels of the shadow map
  vec4 shadow_cell;  // of the shadow map, as texture coordinates: origin, size
  vec4 scale;        // lowest value, 1 / (highest - lowest); radius of the scene [m]; depth times
                     // distance [m]
};

// One cloth of the picture.
struct DrawRecord {
  vec4 offset;  // of the cloth frame; w unused
  vec4 colour;  // linear; w unused

  uint particle_count;
  uint constraint_count;
  uint positions;   // in States: [particle_count][3] float [m]
  uint velocities;  // in States: [particle_count][3] float [m/s]; only for speeds

  uint shaded;          // in Shaded: [particle_count]
  uint corner_offsets;  // in Surface: [particle_count + 1]
  uint corners;         // in Surface: [][DRAPE_DRAW_CORNER_WORDS]
  uint end_offsets;     // in Constraints: [particle_count + 1]

  uint ends;         // in Constraints: [][DRAPE_DRAW_END_WORDS]
  uint constraints;  // in Constraints: [constraint_count][DRAPE_DRAW_CONSTRAINT_WORDS]
  uint pins;         // in Constraints: [pin_count]
  uint pin_count;

  float line_radius;  // [m]
  float ball_radius;  // of particles [m]
  float pin_radius;   // [m]
  uint has_surface;   // 0 or 1
};

// The directions of CameraFit (xyz; w unused), two for each side of the picture.
struct DrawReaches {
  vec4 directions[DRAPE_DRAW_REACHES];
};

// Bounds of one cloth in its own frame and of its values, and its reach in the directions of
// DrawReaches, as uints in the order of the floats (lib/float_order.glsl).
struct ClothExtents {
  uint low_x;
  uint low_y;
  uint low_z;
  uint low_value;

  uint high_x;
  uint high_y;
  uint high_z;
  uint high_value;

  uint reaches[DRAPE_DRAW_REACHES];
};

// All points no farther than a radius from a box.
struct SolidRecord {
  vec4 center;  // w: radius [m]
  vec4 axis_x;  // unit; w: half the extent of the box along it [m]
  vec4 axis_y;
  vec4 axis_z;
  vec4 colour;  // linear; w unused
};

struct PlaneRecord {
  vec4 center;     // w: distance at which it has faded out [m]
  vec4 tangent;    // unit; w: coordinate of the centre along it, from a line of the grid [m]
  vec4 bitangent;  // the same
  vec4 grid;       // distance of its lines [m]; the others unused
};

// A rectangle of the legend.
struct LabelRecord {
  vec4 box;      // left, top, right, bottom [px] from the upper left corner
  vec4 texture;  // the same corners in the glyphs, or along the scale (x at the left, y at the top)
  vec4 colour;   // linear, not premultiplied
  uint kind;     // DRAPE_DRAW_LABEL_*
  float corner_radius;  // of panels [px]
  uint padding0;
  uint padding1;
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
