#!/usr/bin/env python3
"""What cannot work ends the node with a status other than 0 and one line that names the cure."""
import os
import subprocess
import unittest

import rostest

from running_node import SPHERE_SCENE, program


class StartupTest(unittest.TestCase):
    def refuses(self, *arguments, **environment):
        done = subprocess.run([program('tissue_sim_node'), '__name:=refused'] + list(arguments), timeout=20,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True,
                              env=dict(os.environ, **environment))
        self.assertNotEqual(done.returncode, 0)
        lines = done.stdout.splitlines()
        self.assertEqual(len(lines), 1, done.stdout)
        # The command line leaves its parameters on the master.
        subprocess.run(['rosparam', 'delete', '/refused'], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return lines[0]

    def test_missing_scene_file(self):
        self.assertIn('/nowhere/scene.yaml', self.refuses('_scene:=/nowhere/scene.yaml'))

    def test_wrong_scene_file(self):
        line = self.refuses('_scene:=' + os.path.realpath(__file__))
        self.assertIn('startup_test.py:', line)

    def test_scene_is_required(self):
        self.assertIn('~scene', self.refuses())

    def test_unknown_parameter_names_the_nearest(self):
        line = self.refuses('_scene:=' + SPHERE_SCENE, '_state_perod:=0.01')
        self.assertIn('~state_perod', line)
        self.assertIn('~state_period', line)

    def test_wrong_type(self):
        self.assertIn('~state_period', self.refuses('_scene:=' + SPHERE_SCENE, '_state_period:=fast'))
        self.assertIn('true or false', self.refuses('_scene:=' + SPHERE_SCENE, '_keep_all_poses:=3'))

    def test_out_of_range(self):
        self.assertIn('~time_jump_threshold', self.refuses('_scene:=' + SPHERE_SCENE, '_time_jump_threshold:=-1'))

    def test_unknown_choice(self):
        line = self.refuses('_scene:=' + SPHERE_SCENE, '_advance:=sometimes')
        self.assertIn('on_pose', line)
        self.assertIn('realtime', line)

    def test_no_master(self):
        line = self.refuses('_scene:=' + SPHERE_SCENE, ROS_MASTER_URI='http://localhost:9')
        self.assertIn('http://localhost:9', line)
        self.assertIn('roscore', line)


if __name__ == '__main__':
    rostest.rosrun('tissue_sim', 'startup_test', StartupTest)
