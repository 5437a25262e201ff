#pragma once

/// The package's messages and services.
#include <tissue_sim/Contact.h>
#include <tissue_sim/Contacts.h>
#include <tissue_sim/GetTopology.h>
#include <tissue_sim/ResetOrgan.h>
#include <tissue_sim/TissueState.h>
#include <tissue_sim/TissueTopology.h>
