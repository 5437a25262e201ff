#!/usr/bin/env python3
"""tissue_sim_bench frame sees the stamps of its poses come back. No time is asserted."""
import json
import os
import shutil
import subprocess
import tempfile
import unittest

import rosbag
import rostest

from running_node import BALL_RADIUS, POSE_TOPIC, PROBE_RADIUS, SPHERE_SCENE, pose_message, program

START = 1000 * 10**9  # ns
TOUCH = BALL_RADIUS + PROBE_RADIUS


class FrameBenchTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)
        self.bag = os.path.join(self.folder, 'press.bag')
        with rosbag.Bag(self.bag, 'w') as bag:
            for i in range(11):
                message = pose_message(START + i * 10**7, (0, 0, TOUCH + 0.002 - 0.0006 * i))
                bag.write('/' + POSE_TOPIC, message, message.header.stamp)

    def bench(self, *more):
        rows = os.path.join(self.folder, 'frame.json')
        command = [program('tissue_sim_bench'), 'frame', '--scene', SPHERE_SCENE, '--bag', self.bag, '--json', rows]
        subprocess.run(command + list(more), check=True, timeout=60)
        with open(rows) as file:
            return json.load(file)

    def test_poses_come_back_on_every_output(self):
        result = self.bench('--rate', '50')
        self.assertEqual(result['bench'], 'frame')
        self.assertEqual([row['output'] for row in result['rows']],
                         ['ball/state', 'contacts', 'probe/measured_cf'])
        for row in result['rows']:
            self.assertEqual(row['published'], 101, row)
            # A busy machine may let poses pile up: the node then goes to the newest of them.
            self.assertEqual(row['received'] + row['missed'], 101, row)
            self.assertGreater(row['received'], 50, row)
            self.assertEqual(row['unknown_stamps'], 0, row)
            self.assertGreater(row['poses_in_contact'], 10, row)
            self.assertGreater(row['ms_median'], 0.0, row)
            self.assertGreaterEqual(row['ms_p99'], row['ms_median'], row)

    def test_a_part_of_the_bag(self):
        self.assertEqual([row['published'] for row in self.bench('--rate', '50', '--poses', '20')['rows']], [20] * 3)

    def test_a_bag_of_another_frame_is_refused(self):
        with rosbag.Bag(self.bag, 'w') as bag:
            for i in range(3):
                message = pose_message(START + i * 10**7, (0, 0, TOUCH), frame='elsewhere')
                bag.write('/' + POSE_TOPIC, message, message.header.stamp)
        command = [program('tissue_sim_bench'), 'frame', '--scene', SPHERE_SCENE, '--bag', self.bag]
        refused = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, timeout=60, text=True)
        self.assertEqual(refused.returncode, 1)
        self.assertIn('elsewhere', refused.stderr)


if __name__ == '__main__':
    rostest.rosrun('tissue_sim', 'frame_bench', FrameBenchTest)
