// What the kernels of self-collision know of one cloth, in Parameters; and the words of their
// arrays.
#ifndef DRAPE_SHADERS_INTERFACE_SELF_CONTACT_RECORD_H_
#define DRAPE_SHADERS_INTERFACE_SELF_CONTACT_RECORD_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// Words of a node of the tree over the patches in Models, in the order of a walk: the node after
// everything below it; of a leaf where its triangles begin and end, its edges, its corners; of
// others nothing (both ends equal). The first child comes next, the second one after all below it.
#define DRAPE_CONTACT_NODE_WORDS 7
// Words of the state of the contacts in Scratch, which the kernels of a step pass on.
#define DRAPE_CONTACT_STATE_WORDS 8
// Words of a box of positions and one of velocities.
#define DRAPE_CONTACT_BOX_WORDS 12
// Words of a pair: its four particles, flags, the distance at which it touches [m], normal xyz,
// weights of the particles, effective inverse mass [1/kg], gap and floor [m], push [m/s], tangent
// xyz [m/s], how fast it slides when the substep begins [m/s].
#define DRAPE_CONTACT_PAIR_WORDS 21
// Places of two members of the record.
#define DRAPE_CONTACT_CAPACITY 9u
#define DRAPE_CONTACT_MAY_GROW 10u
// Pairs are solved in at most so many turns.
#define DRAPE_CONTACT_TURNS 1024u
// Sums over a zone of particles: 16 numbers of two words, and a count.
#define DRAPE_CONTACT_SUM_WORDS 33

// Members in order, floats and then uints; a macro, so that GLSL can read them one by one.
#define DRAPE_CONTACT_MEMBERS(number, count)                                                      \
  number(thickness)            /* [m] */                                                          \
      number(friction_static)  /* [-] */                                                          \
      number(friction_dynamic) /* [-] */                                                          \
      number(edge_length)      /* of a typical edge [m] */                                        \
      number(gravity)          /* its length [m/s^2] */                                           \
      count(vertex_count) count(edge_count) count(node_count) count(level_count)                  \
          count(capacity)   /* pairs that fit; the same for all arrays of pairs */                \
      count(may_grow)       /* 1: a step that needs more is not committed */                      \
      count(most_around)    /* triangles at a particle */                                         \
      count(has_crossings)  /* 1: crossing_flags are set */                                       \
      count(rest_positions) /* in Models: [particle_count][3] float [m] */                        \
      count(vertices)       /* [vertex_count] uint, of triangles */                               \
      count(edges)          /* [edge_count][2] uint, patch by patch */                            \
      count(triangles)      /* [][3] uint, patch by patch */                                      \
      count(nodes)          /* [node_count][DRAPE_CONTACT_NODE_WORDS] */                          \
      count(levels)         /* [level_count + 1] uint, of level_nodes, the deepest level first */ \
      count(level_nodes)    /* [] uint, nodes that are no leaves */                               \
      count(corners)        /* [] uint, particles of the leaves */                                \
      count(neighbour_offsets) /* [particle_count + 1] uint */                                    \
      count(neighbours)        /* [] uint, particles at the other ends of edges */                \
      count(around_offsets)    /* [particle_count + 1] uint */                                    \
      count(corners_around)    /* [][2] uint, the other corners of each triangle at a particle */ \
      count(crossing_flags)    /* in Parameters: [particle_count] uint, of what began crossing */ \
      count(state)             /* in Scratch: [DRAPE_CONTACT_STATE_WORDS] */                      \
      count(starts)            /* [particle_count][3] float, where the substep began [m] */       \
      count(found_positions)   /* [particle_count][3] float, of the last search [m] */            \
      count(found_velocities)  /* [particle_count][3] float [m/s] */                              \
      count(boxes)             /* [node_count][DRAPE_CONTACT_BOX_WORDS] float */                  \
      count(places)            /* [vertex_count + edge_count] uint, where pairs of each begin */  \
      count(claims)            /* [particle_count] uint, the pair that takes its turn */          \
      count(zones)             /* [particle_count] uint, smallest particle of its zone */         \
      count(wanted)            /* [particle_count][3] float, ends before any stopped [m] */       \
      count(shares)            /* [particle_count] float, of its way that a particle goes */      \
      count(pin_pushes)        /* [particle_count][3] int, from pins beyond the start */          \
      count(sums)              /* [particle_count][DRAPE_CONTACT_SUM_WORDS], by zones */          \
      count(pairs)             /* [DRAPE_CONTACT_PAIR_WORDS][capacity] */                         \
      count(pending)           /* [capacity] uint, pairs that wait for a turn */                  \
      count(order)             /* [capacity] uint, pairs turn by turn */                          \
      count(turns)             /* [DRAPE_CONTACT_TURNS] uint, where each turn ends in the order */

#define DRAPE_CONTACT_NUMBER(name) float name;
#define DRAPE_CONTACT_COUNT(name) uint name;
struct SelfContactRecord {
  DRAPE_CONTACT_MEMBERS(DRAPE_CONTACT_NUMBER, DRAPE_CONTACT_COUNT)
};
#undef DRAPE_CONTACT_NUMBER
#undef DRAPE_CONTACT_COUNT

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
