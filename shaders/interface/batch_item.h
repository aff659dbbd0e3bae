// The work list of a dispatch: one entry per cloth (or per column for the kernel `pack`).
#ifndef DRAPE_SHADERS_INTERFACE_BATCH_ITEM_H_
#define DRAPE_SHADERS_INTERFACE_BATCH_ITEM_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

struct BatchItem {
  uint cloth;   // index into Cloths
  uint status;  // index into Statuses
};

// A run of words to copy from States to Packed.
struct PackItem {
  uint source;  // word offset in States
  uint target;  // word offset in Packed
  uint count;   // words
  uint padding;
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
