// A session: the lease under which cloths live, and every request about them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drape/error.h"
#include "drape/states.h"
#include "drape/streams.h"
#include "drape/v1/cloths.pb.h"
#include "drape/v1/render.pb.h"
#include "drape/v1/session.pb.h"
#include "drape/v1/simulation_service.pb.h"
#include "drape/v1/snapshots.pb.h"
#include "drape/v1/step.pb.h"

namespace drape {
inline namespace client {

struct Connection;  // private

struct SessionOptions {
  // Lease, 1 to 86400 s: how long the server keeps the session without a request. Unset: the
  // server's default.
  std::optional<double> ttl_s;
  // Free text for operators.
  std::string display_name;
  // Renew the lease from a thread of the library, three times per lease, while this object lives.
  bool renews_lease = true;
};

// Of Session::Restore, in the order of the snapshot.
struct RestoredCloths {
  std::vector<ClothId> cloths;
  std::vector<ClothId> former_cloths;  // what they were called
};

// A lease on the server and its cloths. Thread-safe: requests from several threads are independent.
// A server with checkpoints that has started again holds the session as it was some time before.
// Every request fails then with kFailedPrecondition (STATE_LOST), and does nothing, until Reattach.
// Unless Detach() was called, the destructor of a session made by Client::CreateSession deletes it
// on the server with all its cloths; an attached session stays.
class Session {
 public:
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  // "sessions/<server>-<token>". The name gives access: keep it secret.
  const std::string& name() const;
  // The server's present view of it. Also extends the lease.
  v1::Session Renew();
  // After STATE_LOST: takes the session as it came back. Look where its cloths are (ListCloths):
  // later steps, cloths and changes are lost, and so are saved states, subscriptions and request
  // ids. Throws kNotFound if it did not come back.
  v1::Session Reattach();
  // The reason why automatic renewal gave up (the session no longer exists); unset while it works.
  std::optional<Error> lease_error() const;
  // Leaves the session on the server when this object is destroyed; its lease then expires.
  void Detach();
  // Deletes it now; throws errors that the destructor would ignore. Later requests fail with
  // kNotFound.
  void Delete();

  // One cloth, or `count` copies in the same place.
  ClothId CreateCloth(const v1::ClothSpec& spec);
  std::vector<ClothId> CreateCloths(const v1::ClothSpec& spec, uint32_t count);
  // CreateCloths with all its options. `request.session` is filled in by the library, here and in
  // the other functions that take a request.
  v1::CreateClothsResponse CreateCloths(v1::CreateClothsRequest request);

  v1::Cloth GetCloth(ClothId cloth) const;
  // Every cloth of the session (all pages), in order of creation.
  std::vector<v1::Cloth> ListCloths() const;
  // Sets the fields named by `paths`, e.g. {"environment.gravity_m_per_s2"}, from `spec`; for all
  // the cloths or for none.
  v1::ClothShape UpdateCloths(std::span<const ClothId> cloths, const v1::ClothSpec& spec,
                              std::span<const std::string> paths);
  // UpdateCloths with all its options: a change of each cloth of its own by `overrides`.
  v1::ClothShape UpdateCloths(v1::UpdateClothsRequest request);
  void DeleteCloths(std::span<const ClothId> cloths);
  void DeleteCloths(v1::DeleteClothsRequest request);
  // Back to the state of creation. At least one cloth: an empty list is kInvalidArgument.
  void ResetCloths(std::span<const ClothId> cloths);
  // The same of every cloth of the session.
  void ResetCloths();
  // ResetCloths with all its options: other places, other parameters.
  void ResetCloths(v1::ResetClothsRequest request);

  // `steps` >= 1 steps of every cloth of the session; waits for the answer.
  v1::StepResponse Step(uint32_t steps);
  v1::StepResponse Step(v1::StepRequest request);
  // The same with states of any size, which come in chunks of about 1 MiB and stay where they
  // arrived. Step brings 64 MiB of them at most, in one message.
  SteppedStates StepStates(v1::StepRequest request);
  // For several requests in flight.
  StepStream OpenStepStream();

  // The server steps by itself, in real time unless `start` says otherwise. `start.session` is
  // filled in, and `all_cloths` unless it names some.
  RunStream Run(v1::RunRequest::Start start = {});

  // At least one cloth. `view` unset: positions only, of all particles.
  States ReadStates(std::span<const ClothId> cloths, const v1::StateView& view = {}) const;
  // The same of every cloth of the session.
  States ReadStates(const v1::StateView& view = {}) const;
  // Puts particles elsewhere; see WriteStates of the service.
  void WriteStates(v1::WriteStatesRequest request);
  // States that the server keeps by name until the session ends; see SaveStates of the service.
  v1::SaveStatesResponse SaveStates(v1::SaveStatesRequest request);
  void LoadStates(v1::LoadStatesRequest request);
  void DropStates(const std::string& name);
  void DropStates(v1::DropStatesRequest request);
  // The cloths as bytes, with everything that they go on from; no cloths: every one of the session.
  // While they come they count among the saved states of the server. An export that is cut goes on.
  std::string TakeSnapshot(std::span<const ClothId> cloths = {}) const;
  // Creates the cloths of a snapshot, all or none. They go on with the bits that they would have
  // had; with `inexact` a snapshot of another build, backend or device is accepted, whose cloths go
  // on with others. Throws kInvalidArgument (SNAPSHOT_DAMAGED), kFailedPrecondition (OTHER_BUILD,
  // SNAPSHOT_TOO_NEW), kResourceExhausted. `request_id`: a repetition with the same id and snapshot
  // gets the same cloths.
  RestoredCloths Restore(std::string_view snapshot, bool inexact = false,
                         const std::string& request_id = {});
  // Triangles, edges, rest shape and collider meshes of a cloth.
  v1::Topology ReadTopology(ClothId cloth) const;
  // A PNG file of the present cloths; see RenderRequest. Throws kFailedPrecondition (NO_EGL_DEVICE)
  // when the server cannot draw.
  v1::RenderResponse Render(v1::RenderRequest request) const;
  // Follows cloths while others step them. `subscribe.session` is filled in.
  StateStream StreamStates(v1::StreamStatesRequest::Subscribe subscribe) const;

 private:
  friend class Client;
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace client
}  // namespace drape
