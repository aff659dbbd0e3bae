// What gRPC orders, for ThreadSanitizer: gRPC is not compiled with it, so it sees no other order
// between its threads than that of the locks that they share with us. These functions come before
// gRPC's own of the same name.
#if defined(__SANITIZE_THREAD__)

#include <absl/synchronization/mutex.h>
#include <dlfcn.h>
#include <grpc/grpc.h>
#include <grpcpp/alarm.h>
#include <grpcpp/support/server_callback.h>
#include <sanitizer/tsan_interface.h>

#include <atomic>
#include <functional>
#include <utility>

namespace {

template <class Function>
Function* Next(Function*, const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

// `tag` names the operation until its end is told.
grpc_call_error grpc_call_start_batch(grpc_call* call, const grpc_op* ops, size_t nops, void* tag,
                                      void* reserved) {
  static auto* const next = Next(&grpc_call_start_batch, "grpc_call_start_batch");
  __tsan_release(tag);
  return next(call, ops, nops, tag, reserved);
}

grpc_event grpc_completion_queue_next(grpc_completion_queue* queue, gpr_timespec deadline,
                                      void* reserved) {
  static auto* const next = Next(&grpc_completion_queue_next, "grpc_completion_queue_next");
  const grpc_event event = next(queue, deadline, reserved);
  if (event.type == GRPC_OP_COMPLETE) __tsan_acquire(event.tag);
  return event;
}

grpc_event grpc_completion_queue_pluck(grpc_completion_queue* queue, void* tag,
                                       gpr_timespec deadline, void* reserved) {
  static auto* const next = Next(&grpc_completion_queue_pluck, "grpc_completion_queue_pluck");
  const grpc_event event = next(queue, tag, deadline, reserved);
  if (event.type == GRPC_OP_COMPLETE) __tsan_acquire(tag);
  return event;
}

}  // extern "C"

// The end of a call, and its cancellation, are told on the thread that knows of them: gRPC would
// hand them to a thread of its own by a queue without a lock.
namespace grpc::internal {

void ServerCallbackCall::ScheduleOnDone(bool) {
  // After whoever gave up the call before; gRPC itself may be the last one.
  callbacks_outstanding_.fetch_add(0, std::memory_order_acq_rel);
  CallOnDone();
}

void ServerCallbackCall::CallOnCancel(ServerReactor* reactor) {
  on_cancel_conditions_remaining_.fetch_add(0, std::memory_order_acq_rel);
  reactor->OnCancel();
}

}  // namespace grpc::internal

// Its locks, with which gRPC's headers keep what ends before it has begun.
namespace absl {

void Mutex::Lock() {
  static auto* const next = Next<void(Mutex*)>(nullptr, "_ZN4absl7debian35Mutex4LockEv");
  next(this);
  __tsan_acquire(this);
}

void Mutex::Unlock() {
  static auto* const next = Next<void(Mutex*)>(nullptr, "_ZN4absl7debian35Mutex6UnlockEv");
  __tsan_release(this);
  next(this);
}

}  // namespace absl

// What was done before an alarm was set is done before it rings, and that before the alarm is
// destroyed; here for all alarms together.
namespace {

char alarms;

struct AfterAlarms {
  ~AfterAlarms() { __tsan_acquire(&alarms); }
};

struct Ring {
  std::function<void(bool)> ring;
  AfterAlarms destroyed_first{};

  void operator()(bool is_time) {
    __tsan_acquire(&alarms);
    ring(is_time);
    __tsan_release(&alarms);
  }
};

}  // namespace

namespace grpc {

void Alarm::SetInternal(gpr_timespec deadline, std::function<void(bool)> ring) {
  using Function = void(Alarm*, gpr_timespec, std::function<void(bool)>);
  static auto* const next =
      Next<Function>(nullptr, "_ZN4grpc5Alarm11SetInternalE12gpr_timespecSt8functionIFvbEE");
  std::function<void(bool)> then = Ring{std::move(ring)};
  __tsan_release(&alarms);
  next(this, deadline, std::move(then));
}

}  // namespace grpc

#endif
