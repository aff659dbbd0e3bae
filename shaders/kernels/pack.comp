// Kernel `pack`: gathers the requested columns of many cloths into one block, so that they come back in one
// transfer. One work group = one item (a run of a column of one cloth). Reads States; writes Packed.
#include "interface/bindings.h"
#include "interface/batch_item.h"

layout(local_size_x = LOCAL_SIZE) in;

layout(std430, binding = DRAPE_BINDING_ITEMS) restrict readonly buffer PackItems {
  PackItem pack_items[];
};
layout(std430, binding = DRAPE_BINDING_STATES) restrict readonly buffer States {
  float states[];
};
layout(std430, binding = DRAPE_BINDING_PACKED) restrict writeonly buffer Packed {
  float packed_words[];
};
layout(location = DRAPE_UNIFORM_FIRST_ITEM) uniform uint first_item;

void main() {
  PackItem item = pack_items[first_item + gl_WorkGroupID.x];
  for (uint word = gl_LocalInvocationID.x; word < item.count; word += LOCAL_SIZE) {
    packed_words[item.target + word] = states[item.source + word];
  }
}
