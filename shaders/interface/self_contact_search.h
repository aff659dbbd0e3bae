// Numbers of self-collision: those of server/solver/self_contact, and of its kernels. The search
// for pairs that may touch, and their friction.
#ifndef DRAPE_SHADERS_INTERFACE_SELF_CONTACT_SEARCH_H_
#define DRAPE_SHADERS_INTERFACE_SELF_CONTACT_SEARCH_H_

// A search is for at most so many edge lengths of the way of the fastest particle relative to the
// mean [-], and for at most so long [s]. Larger: more pairs that never touch; smaller: more
// searches.
#define DRAPE_CONTACT_SEARCH_WAY 0.25
#define DRAPE_CONTACT_LONGEST_SEARCH (1.0 / 60.0)
// The drift that a search allows for: these shares of the thickness, of an edge, and of the way in
// free fall [-]. Larger: more pairs are looked at in each substep; smaller: more searches.
#define DRAPE_CONTACT_DRIFT_THICKNESS 0.5
#define DRAPE_CONTACT_DRIFT_EDGE 0.05
#define DRAPE_CONTACT_DRIFT_FALL 0.5

// Substeps given up one after the other before the rest of the step is [-]. The first may be given
// up because of how fast its particles move; then all move alike, the second begins with what no
// later one will change, and nobody has to look again before the next step.
#define DRAPE_CONTACT_MOST_GIVEN_UP 2

// The sine of the angle by which a normal has to lean over a neighbouring triangle for that to
// cover the pair [-]. Larger: pairs hinder what slides; smaller: rounding could leave a vertex
// above an edge without any pair.
#define DRAPE_CONTACT_LEAST_LEAN 1e-3
// A pair slides where it does so faster than static friction could stop it within this many
// substeps [-]. Larger: what begins to slide feels the static friction for longer; smaller: pairs
// that slip because others carry their load spread that to their neighbours.
#define DRAPE_CONTACT_SLIP_SUBSTEPS 6.0
// Rounds of impulses that stop what lands, at the end of its substep [-]. Fewer: part of the
// friction of a landing is lost, and layers land sliding; more: time.
#define DRAPE_CONTACT_LANDING_ROUNDS 8

#endif
