// What a snapshot may take in memory before its cloths are there.
#include "server/api/snapshot_reading.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_writing.h"
#include "tests/session/session_fixture.h"

namespace drape::api {
namespace {

class SnapshotReading : public SessionFixture {
 protected:
  // A snapshot of two chains of one model, taken apart.
  void Save() {
    Start();
    const auto cloths = Create(Chains(2, 3)).value();
    Awaited<Status> saved;
    session().SaveStates(Find(cloths.ids), "a", [saved](const Result<SavedSummary>& r) mutable {
      saved.Set(r.ok() ? Status::Ok() : r.status());
    });
    ASSERT_TRUE(saved.Get().ok());
    const std::string bytes =
        WriteSnapshot(*session().FindSaved("a"), scheduler_->description(), "test").value();
    SnapshotReader reader(bytes);
    models_.resize(1);
    cloths_.resize(2);
    ASSERT_TRUE(reader.Begin().ok() && reader.Read(header_).ok() && reader.Read(models_[0]).ok() &&
                reader.Read(cloths_[0]).ok() && reader.Read(cloths_[1]).ok());
  }

  std::string Bytes() {
    header_.set_models(static_cast<uint32_t>(models_.size()));
    SnapshotWriter writer;
    EXPECT_TRUE(writer.Add(header_).ok());
    for (const auto& model : models_) EXPECT_TRUE(writer.Add(model).ok());
    for (const auto& cloth : cloths_) EXPECT_TRUE(writer.Add(cloth).ok());
    return writer.Take();
  }
  Result<std::vector<SavedCloth>> Read(Session& session, const std::string& bytes) {
    return ReadSnapshot(bytes, {scheduler_->description(), limits_, nullptr, session, true});
  }
  Result<std::vector<SavedCloth>> Read() { return Read(session(), Bytes()); }

  RequestLimits limits_;
  v1::SnapshotHeader header_;
  std::vector<v1::ModelSnapshot> models_;
  std::vector<v1::ClothSnapshot> cloths_;
};

TEST_F(SnapshotReading, StopsOnceNobodyWantsTheCloths) {
  ASSERT_NO_FATAL_FAILURE(Save());
  const std::string bytes = Bytes();
  size_t asked = 0;
  const auto read = [&](size_t last) {
    asked = 0;
    StopWhenUnwanted then([&] { return ++asked == last; });
    return ReadSnapshot(bytes, {scheduler_->description(), limits_, &then, session(), true});
  };
  EXPECT_TRUE(read(0).ok());
  const size_t asked_in_all = asked;
  ASSERT_GT(asked_in_all, 5u) << "models and cloths";
  for (size_t last = 1; last <= asked_in_all; ++last) {
    EXPECT_THROW((void)read(last), WorkStopped);
    EXPECT_EQ(asked, last);
  }
  EXPECT_EQ(Read().value().size(), 2u);
}

TEST_F(SnapshotReading, ModelsThatNoClothNamesAreRefused) {
  ASSERT_NO_FATAL_FAILURE(Save());
  EXPECT_EQ(Read().value().size(), 2u);
  models_.push_back(models_[0]);
  EXPECT_EQ(Read().status().violations().at(0).field, "models[1]");
  cloths_[1].set_model(1);
  EXPECT_EQ(Read().value().size(), 2u);
  models_.push_back(models_[0]);
  EXPECT_EQ(Read().status().reason(), "SNAPSHOT_DAMAGED") << "more models than cloths";
  models_.pop_back();
  header_.set_meshes(2 * limits_.max_mesh_colliders_per_cloth + 1);
  const Status meshes = Read().status();
  EXPECT_NE(meshes.message().find("33 meshes"), std::string::npos) << meshes.ToString();
}

// Before the cloths are looked at, of which nothing has come.
TEST_F(SnapshotReading, ModelsCountAsSoonAsTheyAreRead) {
  ASSERT_NO_FATAL_FAILURE(Save());
  const uint64_t charge_bytes = 2 * SizeOf_bytes(*Find({})[0]->description()->model);
  SessionLimits limits;
  limits.max_model_bytes = 3 * charge_bytes;  // an owner may have half
  SessionRegistry registry(*scheduler_, limits, clock_, "small");
  const SessionLease small = registry.Create(std::nullopt, "small").value();
  EXPECT_TRUE(Read(*small, Bytes()).ok());
  models_.push_back(models_[0]);
  models_[1].mutable_spec()->mutable_particles()->mutable_masses_kg()->Set(0, 7);
  cloths_.clear();
  EXPECT_EQ(Read(*small, Bytes()).status().reason(), "QUOTA_EXCEEDED");
  EXPECT_EQ(Read(session(), Bytes()).status().reason(), "SNAPSHOT_DAMAGED");
  // Nothing is held any longer.
  models_.pop_back();
  EXPECT_EQ(Read(*small, Bytes()).status().reason(), "SNAPSHOT_DAMAGED");
}

// A few bytes each in the snapshot.
TEST_F(SnapshotReading, CollidersCountAsSoonAsTheyAreRead) {
  ASSERT_NO_FATAL_FAILURE(Save());
  for (v1::ClothSnapshot& cloth : cloths_) {
    for (int k = 0; k < 100; ++k) {
      auto* sphere = cloth.mutable_spec()->mutable_environment()->add_colliders()->mutable_sphere();
      for (const double x : {0.0, -5.0, 0.0}) sphere->add_center_m(x);
      sphere->set_radius_m(1);
    }
  }
  SessionLimits limits;
  limits.max_model_bytes = 600'000;  // an owner may have half
  SessionRegistry registry(*scheduler_, limits, clock_, "small");
  const SessionLease small = registry.Create(std::nullopt, "small").value();
  EXPECT_EQ(Read(*small, Bytes()).status().reason(), "QUOTA_EXCEEDED");
  cloths_[1].mutable_spec()->mutable_environment()->clear_colliders();
  const auto read = Read(*small, Bytes());
  EXPECT_TRUE(read.ok()) << read.status().ToString();
}

// Whoever counts is asked before each record, and none is made that it refuses.
TEST_F(SnapshotReading, WhatIsWrittenCountsAsItGrows) {
  ASSERT_NO_FATAL_FAILURE(Save());
  const auto saved = session().FindSaved("a");
  std::vector<uint64_t> counted;
  const auto bytes = WriteSnapshot(*saved, scheduler_->description(), "1", [&](uint64_t size) {
    counted.push_back(size);
    return Status::Ok();
  });
  ASSERT_TRUE(bytes.ok());
  ASSERT_EQ(counted.size(), 2 + saved->cloths.size()) << "the header, the model, the cloths";
  EXPECT_TRUE(std::ranges::is_sorted(counted));
  EXPECT_EQ(counted.back(), bytes->size());
  const auto refused = WriteSnapshot(*saved, scheduler_->description(), "1", [&](uint64_t size) {
    return size < counted[1] ? Status::Ok() : Status(StatusCode::kResourceExhausted, "FULL", "");
  });
  EXPECT_EQ(refused.status().reason(), "FULL");
}

// Parts without content take two bytes each on the wire.
TEST_F(SnapshotReading, RecordsThatTakeManyTimesTheirBytesAreNotParsed) {
  ASSERT_NO_FATAL_FAILURE(Save());
  for (int k = 0; k < 200'000; ++k) cloths_[1].mutable_spec()->add_pins();
  limits_.max_request_bytes = 1u << 20;
  EXPECT_EQ(Read().status().reason(), "REQUEST_TOO_LARGE");
  // Numbers take their bytes.
  cloths_[1].mutable_spec()->clear_pins();
  for (int k = 0; k < 3'000'000; ++k) {
    cloths_[1].mutable_runtime()->mutable_pins()->add_starts(k);
  }
  EXPECT_EQ(Read().status().reason(), "INVALID_FIELDS");
}

}  // namespace
}  // namespace drape::api
