"""From a posterior to indicators with intervals, and the classic least-squares evaluation beside them."""
