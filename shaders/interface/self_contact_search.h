// Numbers of the search for pairs that may touch: those of server/solver/self_contact, and of the
// kernels of self-collision.
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

#endif
