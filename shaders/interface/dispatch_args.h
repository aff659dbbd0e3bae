// Arguments of glDispatchComputeIndirect, written on the device.
#ifndef DRAPE_SHADERS_INTERFACE_DISPATCH_ARGS_H_
#define DRAPE_SHADERS_INTERFACE_DISPATCH_ARGS_H_

#ifdef __cplusplus
#include "shaders/interface/types.h"
namespace drape::shader {
#endif

// The first three as OpenGL wants them; the kernels switch a dispatch off by setting group_count_y
// to 0 and on again by copying active_group_count_y.
struct DispatchArgs {
  uint group_count_x;
  uint group_count_y;
  uint group_count_z;
  uint active_group_count_y;
};

#ifdef __cplusplus
}  // namespace drape::shader
#endif
#endif
