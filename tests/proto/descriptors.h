// The descriptor set that protoc made of proto/, as a pool.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <fstream>
#include <memory>
#include <vector>

#include "server/core/check.h"
#include "tests/support/paths/paths.h"

namespace drape::test {

class Descriptors {
 public:
  Descriptors() {
    const auto path = BuildPath("proto/drape_v1.binpb");
    std::ifstream file(path, std::ios::binary);
    DRAPE_CHECK(set_.ParseFromIstream(&file), "no descriptor set at " + path.string());
    for (const auto& one : set_.file()) pool_.BuildFile(one);
  }

  // Ours: package drape.v1, sorted by file name.
  std::vector<const google::protobuf::FileDescriptor*> Files() const {
    std::vector<const google::protobuf::FileDescriptor*> files;
    for (const auto& one : set_.file()) {
      if (one.package() == "drape.v1") files.push_back(pool_.FindFileByName(one.name()));
    }
    std::sort(files.begin(), files.end(),
              [](const auto* a, const auto* b) { return a->name() < b->name(); });
    return files;
  }

  // The messages of all our files, nested ones included.
  std::vector<const google::protobuf::Descriptor*> Messages() const {
    std::vector<const google::protobuf::Descriptor*> messages;
    for (const auto* file : Files()) {
      for (int k = 0; k < file->message_type_count(); ++k) Append(file->message_type(k), messages);
    }
    return messages;
  }

  std::vector<const google::protobuf::EnumDescriptor*> Enums() const {
    std::vector<const google::protobuf::EnumDescriptor*> enums;
    for (const auto* file : Files()) {
      for (int k = 0; k < file->enum_type_count(); ++k) enums.push_back(file->enum_type(k));
    }
    for (const auto* message : Messages()) {
      for (int k = 0; k < message->enum_type_count(); ++k) enums.push_back(message->enum_type(k));
    }
    return enums;
  }

  // The methods of all services.
  std::vector<const google::protobuf::MethodDescriptor*> Methods() const {
    std::vector<const google::protobuf::MethodDescriptor*> methods;
    for (const auto* file : Files()) {
      for (int k = 0; k < file->service_count(); ++k) {
        for (int n = 0; n < file->service(k)->method_count(); ++n) {
          methods.push_back(file->service(k)->method(n));
        }
      }
    }
    return methods;
  }
  const google::protobuf::Descriptor* Message(const std::string& name) const {
    return pool_.FindMessageTypeByName("drape.v1." + name);
  }

 private:
  static void Append(const google::protobuf::Descriptor* message,
                     std::vector<const google::protobuf::Descriptor*>& messages) {
    if (message->options().map_entry()) return;
    messages.push_back(message);
    for (int k = 0; k < message->nested_type_count(); ++k)
      Append(message->nested_type(k), messages);
  }

  google::protobuf::FileDescriptorSet set_;
  google::protobuf::DescriptorPool pool_;
};

}  // namespace drape::test
