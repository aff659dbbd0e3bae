// Numbers that shaders and host must agree on: storage-block bindings, uniform locations, collider
// kinds, fault bits. Plain #defines, because both C++ and GLSL read this file.
#ifndef DRAPE_SHADERS_INTERFACE_BINDINGS_H_
#define DRAPE_SHADERS_INTERFACE_BINDINGS_H_

// Storage blocks. Eight, the number that OpenGL 4.5 guarantees to a compute shader.
#define DRAPE_BINDING_ITEMS 0
#define DRAPE_BINDING_CLOTHS 1
#define DRAPE_BINDING_MODELS 2
#define DRAPE_BINDING_STATES 3
#define DRAPE_BINDING_PARAMETERS 4
#define DRAPE_BINDING_SCRATCH 5
#define DRAPE_BINDING_STATUSES 6
#define DRAPE_BINDING_DISPATCHES 7
// Only the kernel `pack` has an output block; it uses no dispatch arguments.
#define DRAPE_BINDING_PACKED 7

// Uniforms.
#define DRAPE_UNIFORM_FIRST_ITEM 0
#define DRAPE_UNIFORM_ITEM_COUNT 1
#define DRAPE_UNIFORM_SUBSTEP 2
#define DRAPE_UNIFORM_SWEEP 3
#define DRAPE_UNIFORM_COLOUR 4
#define DRAPE_UNIFORM_DISPATCH_COUNT 5
#define DRAPE_UNIFORM_PART 6
#define DRAPE_UNIFORM_KICK_PLACE 7
#define DRAPE_UNIFORM_PHASE 8
#define DRAPE_UNIFORM_IS_OF_JOINTS 9
#define DRAPE_UNIFORM_ROUND 10
#define DRAPE_UNIFORM_INTEGRATES 11

// Before, within or after a substep: values of the uniform `place`.
#define DRAPE_KICK_BEFORE 0u
#define DRAPE_KICK_WITHIN 1u
#define DRAPE_KICK_AFTER 2u
// In `solve_hinges`.
#define DRAPE_KICK_HINGES 3u

// Particles, and constraints, that one work group measures; words of its result.
#define DRAPE_MEASURE_PIECE 2048u
#define DRAPE_MEASURED_WORDS 15u

// Words of a spring end in a model: other particle, rest length [m], stiffness [N/m], damping [N
// s/m].
#define DRAPE_SPRING_END_WORDS 4
// Words of an elastic element in a model: four particles, the weights of the second to fourth, rest
// length [m], mass [kg], squared frequency [1/s^2], share of damping; of an end of one: impulse,
// weight.
#define DRAPE_ELASTIC_WORDS 11
#define DRAPE_ELASTIC_END_WORDS 2
// Kinds of families of elastic elements (scene/elastic_lines.h, ElasticKind).
#define DRAPE_ELASTIC_RODS 0u
#define DRAPE_ELASTIC_CELLS 1u
#define DRAPE_ELASTIC_DIAGONALS 2u
// Words of a family in a model: kind, rest length [m], where its lines begin and end; of a line:
// first particle, stride, particles, where its entries begin. Words of an entry in the parameters:
// those of ElasticEntry. Words of a solution in Scratch: a vector, the coupling of a diagonal with
// the next one over the pivot, its right side over the pivot [N s].
#define DRAPE_ELASTIC_FAMILY_WORDS 4
#define DRAPE_ELASTIC_LINE_WORDS 4
#define DRAPE_ELASTIC_ENTRY_WORDS 4
#define DRAPE_ELASTIC_SOLUTION_WORDS 5
// Words of a link of a strip in Scratch: direction xyz, coupling over pivot, right side over pivot
// [N s].
#define DRAPE_STRIP_LINK_WORDS 5
// Words of a regular strip in a model: where its links begin and end, first particle, stride from
// one particle to the next modulo 2^32, rest length of each link [m].
#define DRAPE_REGULAR_STRIP_WORDS 5
// Invocations that solve strips together, each with a particle or four of them; the most particles
// of such a strip.
#define DRAPE_STRIP_LANES 32u
// Levels of reduction after which each link is alone; with four particles per lane.
#define DRAPE_STRIP_LANE_LEVELS 5u
#define DRAPE_STRIP_QUAD_LEVELS 3u
// Words of a lane in a model: particle | its place in the strip << 10 | links of the strip << 15,
// or 0 if the lane has none; the place of its link in the lists of links, at the last particle of
// any link. With four particles: first | second << 10 | third << 20; fourth | 1 + its place in the
// strip << 10 | lanes of the strip - 1 << 16 | the place of the strip's first link << 19. The first
// lane may have fewer: it begins with the strip's first particle several times.
#define DRAPE_STRIP_LANE_WORDS 2u
// Invocations that hand each other values through shared memory at most; more would not fit into it
// beside 1024 particles.
#define DRAPE_SHARED_LANES 128u
// In the list of held particles: a grip that holds none.
#define DRAPE_NO_PARTICLE 0xffffffffu

// Sums into which the watch of energy adds up the particles of a cloth: resident, in the memory of
// at least 64 masses; tiled.
#define DRAPE_RESIDENT_ENERGY_SUMS 32u
#define DRAPE_TILED_ENERGY_SUMS 256u

// Words of a tether in a model: pin, length [m].
#define DRAPE_TETHER_WORDS 2

// Kinds of distance constraints (scene/description.h, ConstraintKind).
#define DRAPE_KIND_EQUAL 0u
#define DRAPE_KIND_AT_MOST 1u
#define DRAPE_KIND_AT_LEAST 2u

// Words of a collider in the parameters: kind (COLLIDER_SPHERE and so on, defined for each of
// kShapeNames), its ColliderNumbers (server/scene/colliders.h: radius [m], point xyz [m], vector
// xyz, three axes xyz), place of its distance map in Models.
#define DRAPE_COLLIDER_WORDS 18

// Words of a distance map in Models before its samples, x fastest [m]: samples along x, y and z,
// cell [m], 1 / cell [1/m].
#define DRAPE_MAP_HEADER_WORDS 5

// Words of the motion of a collider in the parameters, as at the start of the step: pivot as
// described xyz [m], position of it xyz [m], columns of the rotation 3 xyz, velocity xyz [m/s],
// axis of the turn xyz, angular velocity xyz [rad/s], turns per second, and for a substep of h s
// and the angle a in it sin(a)/a and h (1 - cos(a))/a^2 [s].
#define DRAPE_COLLIDER_MOTION_WORDS 27

// A step may leave out colliders that nothing touches, of the first 24; sets of them are bits of a
// float's mantissa.
#define DRAPE_LEFT_OUT_COLLIDERS 24u
// Words of the range of a cloth's free particles when the step begins, of each the largest as
// lib/float_order.glsl orders floats: -x, -y, -z, x, y, z [m], square of the speed [m^2/s^2],
// square of the way of a pin [m^2].
#define DRAPE_RANGE_WORDS 8

// Bits of ClothStatus::fault.
#define DRAPE_FAULT_NOT_FINITE 1u
#define DRAPE_FAULT_RUNAWAY 2u

#endif
