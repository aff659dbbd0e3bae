// Numbers that the drawing shaders and the host must agree on. Plain #defines, because both C++ and
// GLSL read this file.
#ifndef DRAPE_SHADERS_INTERFACE_DRAW_BINDINGS_H_
#define DRAPE_SHADERS_INTERFACE_DRAW_BINDINGS_H_

// Uniform blocks.
#define DRAPE_DRAW_BINDING_FRAME 0
#define DRAPE_DRAW_BINDING_REACHES 1

// Storage blocks.
#define DRAPE_DRAW_BINDING_CLOTHS 0
#define DRAPE_DRAW_BINDING_STATES 1
#define DRAPE_DRAW_BINDING_SHADED 2
#define DRAPE_DRAW_BINDING_SURFACE 3
#define DRAPE_DRAW_BINDING_CONSTRAINTS 4
#define DRAPE_DRAW_BINDING_EXTENTS 5
// Colours of groups, balls, planes or labels: the instances of a draw.
#define DRAPE_DRAW_BINDING_INSTANCES 6
#define DRAPE_DRAW_BINDING_LIT 7
// Storage blocks that a vertex shader uses at most.
#define DRAPE_DRAW_VERTEX_STORAGE_BLOCKS 5

// Texture units.
#define DRAPE_DRAW_UNIT_SHADOW 0
#define DRAPE_DRAW_UNIT_GLYPHS 1
// The samples of a picture.
#define DRAPE_DRAW_UNIT_COLOURS 2
#define DRAPE_DRAW_UNIT_DEPTHS 3

// Uniforms.
#define DRAPE_DRAW_UNIFORM_FIRST_CLOTH 0
#define DRAPE_DRAW_UNIFORM_COLOURING 1
#define DRAPE_DRAW_UNIFORM_QUARTER_FACES 2
#define DRAPE_DRAW_UNIFORM_BALL_KIND 3
#define DRAPE_DRAW_UNIFORM_MESH 4
#define DRAPE_DRAW_UNIFORM_FIRST_INSTANCE 5
#define DRAPE_DRAW_UNIFORM_ROWS 6

// Directions in which the extent of cloths is measured.
#define DRAPE_DRAW_REACHES 8

// Kind of a value; 0 where colours do not come from values.
#define DRAPE_DRAW_NO_VALUE 0u
#define DRAPE_DRAW_STRAIN 1u
#define DRAPE_DRAW_SIZE 2u
#define DRAPE_DRAW_GROUPS 3u

// The balls that particle_balls.vert draws.
#define DRAPE_DRAW_BALL_PARTICLES 0u
#define DRAPE_DRAW_BALL_PINS 1u

// Words of an entry of the arrays of a model: triangle corners (the two other particles),
// constraint ends (other particle | DRAPE_DRAW_KIND_*, rest length [m]), constraints (two
// particles, colour group).
#define DRAPE_DRAW_CORNER_WORDS 2u
#define DRAPE_DRAW_END_WORDS 2u
// Bits above the particle: ropes have no compressive, struts no tensile strain.
#define DRAPE_DRAW_KIND_AT_MOST 0x40000000u
#define DRAPE_DRAW_KIND_AT_LEAST 0x80000000u
#define DRAPE_DRAW_PARTICLE_BITS 0x3fffffffu
#define DRAPE_DRAW_CONSTRAINT_WORDS 3u
// Words of a corner of a mesh collider: position xyz [m], normal xyz.
#define DRAPE_DRAW_MESH_CORNER_WORDS 6u

// Words of a particle in Lit.
#define DRAPE_DRAW_LIT_WORDS 3u

// Corners of the disc as which a ball is drawn; vertices of a disc.
#define DRAPE_DRAW_DISC_CORNERS 16
#define DRAPE_DRAW_DISC_VERTICES 42

// LabelRecord::kind.
#define DRAPE_DRAW_LABEL_PANEL 0u
#define DRAPE_DRAW_LABEL_GLYPH 1u
#define DRAPE_DRAW_LABEL_STRAIN_SCALE 2u
#define DRAPE_DRAW_LABEL_SPEED_SCALE 3u

#endif
